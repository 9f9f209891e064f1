//! The invariants of the design, read from cargo's metadata and from the tree.

use cargo_metadata::{MetadataCommand, Package};
use std::collections::{BTreeMap, BTreeSet};

const STAGES: [&str; 5] = ["decompose", "certify", "miqp", "gcs", "check"];

fn packages() -> BTreeMap<String, Package> {
    let metadata = MetadataCommand::new()
        .manifest_path(pipeline_tests::programs::project().join("Cargo.toml"))
        .no_deps()
        .exec()
        .expect("cargo describes the workspace");
    metadata.packages.into_iter().map(|package| (package.name.to_string(), package)).collect()
}

/// What a package depends on to be built, not to be tested.
fn dependencies(package: &Package) -> BTreeSet<&str> {
    let normal =
        package.dependencies.iter().filter(|d| d.kind != cargo_metadata::DependencyKind::Development);
    normal.map(|dependency| dependency.name.as_str()).collect()
}

fn lies_in(package: &Package, folder: &str) -> bool {
    let top = pipeline_tests::programs::project().join(folder);
    package.manifest_path.as_std_path().starts_with(top)
}

#[test]
fn no_stage_depends_on_another_and_the_orchestrator_on_none() {
    let packages = packages();
    for (name, package) in packages.iter().filter(|(name, _)| STAGES.contains(&name.as_str())) {
        for other in STAGES.iter().filter(|other| *other != name) {
            assert!(!dependencies(package).contains(other), "{name} depends on {other}");
        }
    }
    for (name, package) in packages.iter().filter(|(_, package)| lies_in(package, "stages/lib")) {
        for stage in STAGES {
            assert!(!dependencies(package).contains(stage), "{name} depends on stage {stage}");
        }
    }
}

#[test]
fn of_the_workspace_the_orchestrator_knows_the_contract_only() {
    let packages = packages();
    let of_workspace: Vec<_> = dependencies(&packages["orchestrator"])
        .into_iter()
        .filter(|name| packages.contains_key(*name))
        .collect();
    assert_eq!(of_workspace, ["ipc-types"]);
}

#[test]
fn the_contract_depends_on_nothing_of_the_workspace() {
    let packages = packages();
    for name in dependencies(&packages["ipc-types"]) {
        assert!(!packages.contains_key(name), "ipc-types depends on {name}");
    }
}

#[test]
fn foreign_libraries_are_named_in_one_place_each() {
    let homes: [(&str, &[&str]); 5] = [
        ("clarabel", &["conic"]),
        ("parry3d-f64", &["collision"]),
        ("urdf-rs", &["scene"]),
        ("bincode", &["ipc-types"]),
        ("iceoryx2", &["ipc-types", "stage-kit", "orchestrator"]),
    ];
    for (library, homes) in homes {
        for (name, package) in packages() {
            // A test that named the library would tie it down as much as the code.
            let names_it = package.dependencies.iter().any(|dependency| dependency.name == library);
            assert!(!names_it || homes.contains(&name.as_str()), "{name} depends on {library}");
        }
    }
}

#[test]
fn the_checker_shares_no_geometry_with_the_planner() {
    let packages = packages();
    let of_workspace: BTreeSet<_> =
        dependencies(&packages["check"]).into_iter().filter(|name| packages.contains_key(*name)).collect();
    let allowed = BTreeSet::from(["ipc-types", "scene", "stage-kit"]);
    assert!(of_workspace.is_subset(&allowed), "check depends on {of_workspace:?}");
    // What stage-kit brings in must not bring geometry back by the side door.
    for geometry in ["collision", "kinematics", "convex-sets", "conic", "manipulation", "sos"] {
        assert!(!reachable(&packages, "check").contains(geometry), "check reaches {geometry}");
    }
}

fn reachable<'a>(packages: &'a BTreeMap<String, Package>, from: &'a str) -> BTreeSet<&'a str> {
    let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
    while let Some(name) = open.pop() {
        if let Some(package) = packages.get(name).filter(|_| seen.insert(name)) {
            open.extend(dependencies(package));
        }
    }
    seen
}

#[test]
fn mathematical_types_carry_no_serialization() {
    let packages = packages();
    for name in ["convex-sets", "kinematics", "collision", "manipulation", "conic", "scene"] {
        let package = &packages[name];
        assert!(!dependencies(package).contains("ipc-types"), "{name} knows messages; `wire` converts");
    }
}

#[test]
fn the_top_level_is_what_the_design_names() {
    let allowed = BTreeSet::from([
        ".cargo",
        ".ci",
        ".git",
        ".gitignore",
        ".rustfmt.toml",
        "Cargo.lock",
        "Cargo.toml",
        "LICENSE-APACHE",
        "LICENSE-MIT",
        "README.md",
        "ipc-types",
        "orchestrator",
        "scenes",
        "stages",
        "tests",
        // Made by building and planning, and ignored by git.
        "target",
        "runs",
    ]);
    for entry in std::fs::read_dir(pipeline_tests::programs::project()).expect("the project's folder") {
        let name = entry.expect("an entry").file_name();
        let name = name.to_string_lossy();
        assert!(allowed.contains(name.as_ref()), "{name} is not part of the layout");
    }
    for needed in ["README.md", "Cargo.lock", "LICENSE-APACHE", "LICENSE-MIT", ".ci/run", "stages/README.md"]
    {
        assert!(pipeline_tests::programs::project().join(needed).is_file(), "{needed} is missing");
    }
}

#[test]
fn no_file_grows_beyond_six_hundred_lines() {
    let mut open = vec![pipeline_tests::programs::project()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() && !["target", "runs", ".git"].contains(&name.as_str()) {
                open.push(path);
            } else if name.ends_with(".rs") {
                let lines = std::fs::read_to_string(&path).expect("a source file").lines().count();
                assert!(lines <= 600, "{}: {lines} lines", path.display());
            }
        }
    }
}
