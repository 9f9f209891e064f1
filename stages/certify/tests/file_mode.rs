//! The program on files: the same bytes for any number of threads, refusals with their exit codes.

use ipc_types::artefact::{CertificatesFile, PairProof, Region, RegionsFile};
use ipc_types::store::{read_bin, write_artefact};
use scene::Scene;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn scene_folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name)
}

/// A box as a candidate, joint limits included.
fn candidate(scene: &Scene, id: u64, lower: &[f64], upper: &[f64]) -> Region {
    let n = scene.dim();
    let (mut A, mut b) = (Vec::new(), Vec::new());
    let mut face = |j: usize, sign: f64, offset: f64| {
        let mut a = vec![0.0; n];
        a[j] = sign;
        if !A.contains(&a) || !b.contains(&offset) {
            A.push(a);
            b.push(offset);
        }
    };
    for j in 0..n {
        face(j, 1.0, scene.coordinates[j].upper);
        face(j, -1.0, -scene.coordinates[j].lower);
        face(j, 1.0, upper[j]);
        face(j, -1.0, -lower[j]);
    }
    let center = lower.iter().zip(upper).map(|(l, u)| 0.5 * (l + u)).collect();
    Region { id, parent: None, A, b, center, method: "by hand".to_owned(), certified: false, margin: 0.0 }
}

/// Writes `<run>/decompose/regions`.
fn write_candidates(run: &Path, scene: &Scene, regions: Vec<Region>) {
    let coordinates = scene.coordinates.iter().map(|c| c.name.clone()).collect();
    let file = RegionsFile { coordinates, regions, coverage: None };
    write_artefact(&run.join("decompose"), "regions", &file, &scene.digest).expect("a temporary folder");
}

fn certify(scene: &str, run: &Path, out: &Path, options: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_regrasp-certify"))
        .args(["run", "--scene"])
        .arg(scene_folder(scene))
        .arg("--in")
        .arg(run)
        .arg("--out")
        .arg(out)
        .args(options)
        .output()
        .expect("the program starts")
}

fn bands(scene: &Scene) -> Vec<Region> {
    vec![
        candidate(scene, 3, &[-3.0, 0.36, -0.025], &[3.0, 1.0, -0.024]),
        candidate(scene, 4, &[-3.0, 0.37, -0.05], &[3.0, 0.99, -0.0239]),
        candidate(scene, 9, &[-3.0, -0.806, -0.05], &[3.0, -0.644, -0.024]),
        candidate(scene, 12, &[-3.0, -0.7, -0.054], &[3.0, 0.9, -0.043]),
    ]
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = Scene::load(&scene_folder("bottle-cap-3dof")).expect("a reference scene");
    write_candidates(folder.path(), &scene, bands(&scene));
    let mut runs = Vec::new();
    for workers in ["1", "2", "5"] {
        let out = folder.path().join(format!("certify-{workers}"));
        let output = certify("bottle-cap-3dof", folder.path(), &out, &["--workers", workers]);
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let read = |name: &str| std::fs::read(out.join(name)).expect("it was written");
        runs.push((read("regions.bin"), read("regions.json"), read("certificates.bin")));
        let regions: RegionsFile =
            read_bin(&out.join("regions.bin"), Some(&scene.digest)).expect("well formed");
        let certificates: CertificatesFile =
            read_bin(&out.join("certificates.bin"), Some(&scene.digest)).expect("well formed");
        assert_eq!(regions.regions.len(), 4);
        for (region, certificate) in regions.regions.iter().zip(&certificates.regions) {
            assert_eq!(region.id, certificate.region_id);
            assert!(region.certified && region.parent == Some(region.id - certify::CERTIFIED_ID_OFFSET));
            let region = wire::Region::from_artefact(region, 3).expect("well formed");
            certificates::recheck(&scene, &region.polyhedron, certificate)
                .expect("it holds as it was written");
        }
    }
    assert!(runs.windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn a_region_that_needs_a_cut_is_refused_with_its_pair_where_cuts_are_forbidden() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = Scene::load(&scene_folder("bottle-cap-3dof")).expect("a reference scene");
    let beyond_contact = candidate(&scene, 0, &[-3.0, 0.4, -0.03], &[3.0, 0.9, -0.023]);
    write_candidates(folder.path(), &scene, vec![beyond_contact]);
    let out = folder.path().join("certify");
    let output = certify("bottle-cap-3dof", folder.path(), &out, &["--max-cut-loss", "0"]);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{words}");
    assert!(words.contains("gripper/left_finger") && words.contains("cap"), "{words}");
    let output = certify("bottle-cap-3dof", folder.path(), &out, &[]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn sums_of_squares_certify_in_place_of_swept_hulls() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scene = Scene::load(&scene_folder("bottle-cap-3dof")).expect("a reference scene");
    write_candidates(folder.path(), &scene, bands(&scene));
    let out = folder.path().join("certify");
    let output = certify("bottle-cap-3dof", folder.path(), &out, &["--method", "sos"]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let file: CertificatesFile =
        read_bin(&out.join("certificates.bin"), Some(&scene.digest)).expect("certificates");
    assert!(!file.regions.is_empty());
    let pairs = file.regions.iter().flat_map(|region| &region.pairs);
    assert!(pairs.into_iter().all(|pair| matches!(pair.proof, PairProof::SumOfSquares(_))));
}
