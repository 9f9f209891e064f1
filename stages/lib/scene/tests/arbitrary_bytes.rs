//! No input makes the loader panic, and a changed file never keeps the digest.

use proptest::prelude::*;
use scene::Scene;
use std::path::Path;

fn original(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes/two-rooms");
    std::fs::read(folder.join(name)).unwrap()
}

const NAMES: [&str; 3] = ["scene.toml", "pusher.urdf", "block.urdf"];

/// Loads the scene with `bytes` in the place of one file.
fn load_with(name: &str, bytes: &[u8]) -> Result<Scene, scene::SceneError> {
    let folder = tempfile::tempdir().unwrap();
    for other in NAMES {
        let content = if other == name { bytes.to_vec() } else { original(other) };
        std::fs::write(folder.path().join(other), content).unwrap();
    }
    Scene::load(folder.path())
}

/// What replaces a piece of a file: text that means something to one of the parsers, or any byte.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    let words = [
        "",
        "0",
        "-1",
        "nan",
        "inf",
        "1e308",
        "1e-308",
        "=",
        "[",
        "]",
        "{",
        "}",
        "\"",
        "<",
        ">",
        "/>",
        "</",
        "<!--",
        "&",
        "\n",
        "[task.x]",
        "[[model]]",
        "block",
        "type=\"planar\"",
        "type=\"floating\"",
        "99999999999999999999",
    ];
    prop_oneof![
        proptest::sample::select(words.to_vec()).prop_map(|word| word.as_bytes().to_vec()),
        proptest::collection::vec(any::<u8>(), 0..4),
    ]
}

proptest! {
    // No file of failures is kept: they are printed.
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_mutated_file_is_refused_with_a_message_or_keeps_the_rules(
        file in 0..NAMES.len(),
        edits in proptest::collection::vec((any::<prop::sample::Index>(), 0..12_usize, piece()), 1..4),
    ) {
        let mut bytes = original(NAMES[file]);
        for (position, removed, inserted) in edits {
            let start = position.index(bytes.len() + 1);
            let end = (start + removed).min(bytes.len());
            bytes.splice(start..end, inserted);
        }
        match load_with(NAMES[file], &bytes) {
            Err(error) => prop_assert!(!error.to_string().is_empty()),
            Ok(scene) => {
                for c in &scene.coordinates {
                    prop_assert!(c.lower.is_finite() && c.lower < c.upper && c.upper.is_finite());
                }
                for task in scene.tasks.values() {
                    prop_assert_eq!(task.start.len(), scene.dim());
                    prop_assert!((0..scene.dim()).all(|k| task.grasp.lower[k] <= task.grasp.upper[k]));
                }
                scene.collision_pairs();
                let unchanged = bytes == original(NAMES[file]);
                let digest = load_with("scene.toml", &original("scene.toml")).unwrap().digest;
                prop_assert_eq!(scene.digest == digest, unchanged);
            }
        }
    }
}

#[test]
fn deep_nesting_is_refused_before_it_is_parsed() {
    let deep = format!("<robot name=\"x\">{}", "<link>".repeat(1_000_000));
    let message = load_with("pusher.urdf", deep.as_bytes()).unwrap_err().to_string();
    assert!(message.contains("nested more than 100 deep"), "{message}");
    let deep = format!("x = {}", "[".repeat(1_000_000));
    assert!(load_with("scene.toml", deep.as_bytes()).is_err());
}

#[test]
fn files_that_are_not_text() {
    for bytes in [&[][..], &[0; 64], &[0xff; 64], b"\xef\xbb\xbf"] {
        for name in NAMES {
            assert!(load_with(name, bytes).is_err());
        }
    }
}
