//! The README says what is there: its code map, its commands, and CI runs the very command it names.

use pipeline_tests::programs::project;
use std::collections::BTreeSet;
use std::path::Path;

fn readme() -> String {
    std::fs::read_to_string(project().join("README.md")).expect("the project has a README")
}

/// Paths in backquotes in the tables of the section "Code map".
fn code_map() -> BTreeSet<String> {
    let text = readme();
    let section = text.split("\n## Code map").nth(1).expect("a section `Code map`");
    let section = section.split("\n## ").next().unwrap_or(section);
    let in_quotes = section
        .lines()
        .filter(|line| line.starts_with('|'))
        .flat_map(|line| line.split('`').skip(1).step_by(2));
    in_quotes.filter(|word| word.contains('/') || word.ends_with(".rs")).map(str::to_owned).collect()
}

#[test]
fn every_path_of_the_code_map_exists() {
    let map = code_map();
    assert!(map.len() > 30, "the code map has {} paths", map.len());
    for path in map {
        assert!(project().join(&path).exists(), "README.md names {path}, which does not exist");
    }
}

#[test]
fn every_source_file_of_the_stages_is_in_the_code_map() {
    let map = code_map();
    // By its own row, or by that of a folder of sources: a row of a whole package says nothing of a file.
    let listed = |path: &Path| {
        path.ancestors().any(|part| {
            let name = format!("{}/", part.to_string_lossy());
            map.contains(name.trim_end_matches('/')) || (map.contains(&name) && name.contains("/src/"))
        })
    };
    let mut open: Vec<_> = ["stages", "ipc-types", "orchestrator"].map(|root| project().join(root)).into();
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
                continue;
            }
            let relative = path.strip_prefix(project()).expect("below the project").to_owned();
            let is_source =
                path.extension().is_some_and(|e| e == "rs") && relative.iter().any(|part| part == "src");
            let plain = ["lib.rs", "main.rs", "error.rs", "tests.rs"].map(std::ffi::OsStr::new);
            if is_source && !path.file_name().is_some_and(|name| plain.contains(&name)) {
                assert!(listed(&relative), "{} is not in the code map of README.md", relative.display());
            }
        }
    }
}

/// The commands in the first fenced block after a heading.
fn command_after(heading: &str) -> String {
    let text = readme();
    let rest = text.split(heading).nth(1).unwrap_or_else(|| panic!("README.md has no `{heading}`"));
    let block = rest.split("```").nth(1).expect("a fenced block");
    block.lines().skip(1).collect::<Vec<_>>().join("\n").trim().to_owned()
}

#[test]
fn ci_runs_the_tests_by_the_command_of_the_readme() {
    let command = command_after("Run all tests");
    assert!(
        command.starts_with("cargo test") && !command.contains('\n'),
        "`{command}` is not one cargo test"
    );
    let ci = std::fs::read_to_string(project().join(".ci/run")).expect(".ci/run");
    assert!(ci.lines().any(|line| line.contains(&command)), ".ci/run does not run `{command}`");
}

#[test]
fn the_first_command_plans_the_reference_scene() {
    let command = command_after("Plan a scene");
    assert_eq!(command, "cargo build --release && target/release/regrasp plan scenes/bottle-cap-3dof");
}
