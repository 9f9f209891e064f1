//! Kinds of damage to a run of `bottle-cap-3dof`, each with what the verifier must say.

use ipc_types::Digest;
use ipc_types::artefact::{CertificatesFile, Mode, PlanFile, Region, RegionsFile, TrajectoryFile};
use ipc_types::container::{self, Artefact};
use ipc_types::store;
use std::path::Path;

/// One kind of damage.
pub struct Damage {
    /// What is done.
    pub name: &'static str,
    /// Does it to a run directory.
    pub apply: Box<dyn Fn(&Path)>,
    /// Part of the verifier's answer.
    pub expected: &'static str,
}

/// Digest of the scene that a file of the run was made for.
fn digest(run: &Path) -> Digest {
    let file = run.join("certify/regions.bin");
    let bytes = std::fs::read(&file).expect("regions");
    container::header(&file, &bytes).expect("a header").scene_digest
}

/// Changes an artefact and writes it as whoever forges a run would: both twins, digests right.
pub fn forge<A: Artefact>(run: &Path, stage: &str, name: &str, change: impl Fn(&mut A)) {
    let digest = digest(run);
    let folder = run.join(stage);
    let mut value: A = store::read_bin(&folder.join(format!("{name}.bin")), None).expect("an artefact");
    change(&mut value);
    store::write_bin(&folder, name, &value, &digest).expect("the forgery");
    let twin = folder.join(format!("{name}.json"));
    if twin.exists() {
        store::write_json(&folder, name, &value).expect("the forgery's twin");
    }
}

/// Changes the certificates.
pub fn certificates(change: impl Fn(&mut CertificatesFile) + 'static) -> Box<dyn Fn(&Path)> {
    Box::new(move |run| forge(run, "certify", "certificates", &change))
}

/// Changes the regions.
pub fn regions(change: fn(&mut RegionsFile)) -> Box<dyn Fn(&Path)> {
    Box::new(move |run| forge(run, "certify", "regions", change))
}

/// Changes the plan.
pub fn plan(change: fn(&mut PlanFile)) -> Box<dyn Fn(&Path)> {
    Box::new(move |run| forge(run, "miqp", "plan", change))
}

fn trajectory(change: fn(&mut TrajectoryFile)) -> Box<dyn Fn(&Path)> {
    Box::new(move |run| forge(run, "gcs", "trajectory", change))
}

/// Changes bytes of a file.
pub fn bytes(file: &'static str, change: fn(&mut Vec<u8>)) -> Box<dyn Fn(&Path)> {
    Box::new(move |run| {
        let file = run.join(file);
        let mut bytes = std::fs::read(&file).expect("a file of the run");
        change(&mut bytes);
        std::fs::write(&file, bytes).expect("the damage");
    })
}

fn text(file: &'static str, from: &'static str, to: &'static str) -> Box<dyn Fn(&Path)> {
    Box::new(move |run| {
        let file = run.join(file);
        let text = std::fs::read_to_string(&file).expect("a text of the run");
        assert!(text.contains(from), "{}: no `{from}`", file.display());
        std::fs::write(&file, text.replacen(from, to, 1)).expect("the damage");
    })
}

fn remove(file: &'static str) -> Box<dyn Fn(&Path)> {
    Box::new(move |run| std::fs::remove_file(run.join(file)).expect("a file of the run"))
}

#[allow(clippy::ptr_arg, reason = "the type that `bytes` takes")]
fn flip_last(bytes: &mut Vec<u8>) {
    if let Some(last) = bytes.last_mut() {
        *last ^= 1;
    }
}

#[allow(clippy::ptr_arg, reason = "the type that `bytes` takes")]
fn flip_middle(bytes: &mut Vec<u8>) {
    let middle = bytes.len() / 2;
    bytes[middle] ^= 16;
}

fn region(file: &mut RegionsFile) -> &mut Region {
    file.regions.iter_mut().find(|region| region.certified).expect("a certified region")
}

/// All kinds.
pub fn all_damages() -> Vec<Damage> {
    let mut all = files();
    all.extend(of_regions());
    all.extend(super::certificate_damage::all());
    all.extend(super::answer_damage::all());
    all.extend(of_plan());
    all.extend(of_trajectory());
    all
}

/// A kind of damage.
pub fn damage(name: &'static str, apply: Box<dyn Fn(&Path)>, expected: &'static str) -> Damage {
    Damage { name, apply, expected }
}

fn files() -> Vec<Damage> {
    vec![
        damage("a bit of the regions flips", bytes("certify/regions.bin", flip_middle), "regions.bin"),
        damage(
            "a bit of the certificates flips",
            bytes("certify/certificates.bin", flip_middle),
            "certificates.bin",
        ),
        damage(
            "the last bit of the certificates flips",
            bytes("certify/certificates.bin", flip_last),
            "certificates.bin",
        ),
        damage("a bit of the plan flips", bytes("miqp/plan.bin", flip_last), "plan.bin"),
        damage("a bit of the trajectory flips", bytes("gcs/trajectory.bin", flip_last), "trajectory.bin"),
        damage("the magic is another", bytes("miqp/plan.bin", |b| b[0] = b'X'), "plan.bin"),
        damage(
            "the certificates are cut off",
            bytes("certify/certificates.bin", |b| b.truncate(b.len() - 9)),
            "certificates.bin",
        ),
        damage("bytes follow the trajectory", bytes("gcs/trajectory.bin", |b| b.push(0)), "trajectory.bin"),
        damage("the certificates are gone", remove("certify/certificates.bin"), "certificates.bin"),
        damage("the trajectory is gone", remove("gcs/trajectory.bin"), "trajectory.bin"),
        damage("the plan is gone", remove("miqp/plan.bin"), "plan"),
        damage(
            "the twin of the plan differs",
            text("miqp/plan.json", "\"n_grasps\":", "\"n_grasps\": 1"),
            "plan.json",
        ),
        damage(
            "an obstacle moved by a millimetre",
            text("scene/scene.toml", "[0.01, 0.035, 0.02]", "[0.009, 0.035, 0.02]"),
            "scene_digest",
        ),
        damage(
            "the digest of the record is another",
            text("run.json", "\"scene_digest\": \"", "\"scene_digest\": \"0"),
            "scene_digest",
        ),
        damage(
            "an obstacle moved and the record forged",
            Box::new(|run| {
                move_obstacle(run, "[0.009, 0.035, 0.02]");
            }),
            "scene",
        ),
    ]
}

/// Moves the first obstacle, and writes the new digest into run.json.
fn move_obstacle(run: &Path, xyz: &'static str) -> Digest {
    text("scene/scene.toml", "[0.01, 0.035, 0.02]", xyz)(run);
    let moved = scene::Scene::load(&run.join("scene")).expect("the moved scene loads");
    let old = ipc_types::hexadecimal(&digest(run));
    let file = run.join("run.json");
    let record = std::fs::read_to_string(&file).expect("run.json");
    assert!(record.contains(&old));
    std::fs::write(&file, record.replace(&old, &ipc_types::hexadecimal(&moved.digest))).expect("the record");
    moved.digest
}

/// Moves the first obstacle, and signs the regions and their certificates for the moved scene.
fn move_obstacle_and_sign(run: &Path, xyz: &'static str) {
    let regions: RegionsFile = store::read_bin(&run.join("certify/regions.bin"), None).expect("regions");
    let proofs: CertificatesFile =
        store::read_bin(&run.join("certify/certificates.bin"), None).expect("certificates");
    let digest = move_obstacle(run, xyz);
    store::write_artefact(&run.join("certify"), "regions", &regions, &digest).expect("regions");
    store::write_bin(&run.join("certify"), "certificates", &proofs, &digest).expect("certificates");
}

fn of_regions() -> Vec<Damage> {
    vec![
        damage(
            "a face is widened",
            regions(|f| region(f).b.iter_mut().for_each(|b| *b += 1e-3)),
            "of its certificate is not",
        ),
        damage(
            "a face is turned",
            regions(|f| region(f).A.iter_mut().for_each(|a| a.swap(1, 2))),
            "of its certificate is not",
        ),
        damage(
            "a face is dropped",
            regions(|f| {
                let r = region(f);
                r.A.remove(0);
                r.b.remove(0);
            }),
            "of its certificate is not",
        ),
        damage("an offset is not a number", regions(|f| region(f).b[0] = f64::INFINITY), "regions.json"),
        damage(
            "a region stands twice",
            regions(|f| {
                let r = region(f).clone();
                f.regions.push(r);
            }),
            "stands twice",
        ),
        damage(
            "an uncertified region is called certified",
            regions(|f| {
                let mut r = region(f).clone();
                r.id = 987_654;
                f.regions.push(r);
            }),
            "has no certificate",
        ),
        damage(
            "a certified region is called uncertified",
            regions(|f| region(f).certified = false),
            "which is not certified",
        ),
        damage(
            "the coordinates are renamed",
            regions(|f| f.coordinates[0] = "lid".to_owned()),
            "coordinates",
        ),
        damage(
            "a row is too short",
            regions(|f| {
                region(f).A[0].pop();
            }),
            "one a coordinate",
        ),
        damage(
            "an obstacle moved by a millimetre into the swept space and everything signed anew",
            Box::new(|run| move_obstacle_and_sign(run, "[0.011, 0.035, 0.02]")),
            "certify/certificates.bin: region",
        ),
        damage(
            "an obstacle moved towards the cap and everything signed anew",
            Box::new(|run| move_obstacle_and_sign(run, "[0.01, 0.034, 0.02]")),
            "certify/certificates.bin: region",
        ),
    ]
}

fn of_plan() -> Vec<Damage> {
    vec![
        damage("the plan has another number of grasps", plan(|p| p.n_grasps = Some(9)), "number of grasps"),
        damage(
            "a configuration moves",
            plan(|p| p.configurations.as_mut().expect("a plan")[3][1] += 1e-9),
            "3",
        ),
        damage(
            "a configuration is in another region",
            plan(|p| p.regions.as_mut().expect("a plan")[3] = 424_242),
            "not in the region it names",
        ),
        damage(
            "a mode is flipped",
            plan(|p| p.modes.as_mut().expect("a plan")[1] = Mode::Transit),
            "number of grasps",
        ),
        damage("two modes are flipped", plan(|p| p.modes.as_mut().expect("a plan").swap(1, 2)), "wrong mode"),
        damage(
            "a configuration is missing",
            plan(|p| {
                p.configurations.as_mut().expect("a plan").pop();
            }),
            "do not fit",
        ),
        damage(
            "a configuration is not a number",
            plan(|p| p.configurations.as_mut().expect("a plan")[2][0] = f64::INFINITY),
            "plan",
        ),
    ]
}

fn of_trajectory() -> Vec<Damage> {
    vec![
        damage(
            "a segment is removed",
            trajectory(|t| {
                t.segments.remove(4);
            }),
            "do not fit",
        ),
        damage("two segments are swapped", trajectory(|t| t.segments.swap(1, 3)), "does not begin"),
        damage(
            "a segment's mode is flipped",
            trajectory(|t| t.segments[1].mode = Mode::Transit),
            "wrong mode",
        ),
        damage(
            "a bend moves out of its region",
            trajectory(|t| {
                let piece = t.segments.iter_mut().flat_map(|s| &mut s.pieces).next().expect("a piece");
                let middle: Vec<f64> = piece[0].iter().map(|_| 50.0).collect();
                piece.insert(1, middle);
            }),
            "outside region",
        ),
        damage(
            "a kept coordinate slips by a nanoradian",
            trajectory(|t| {
                let segment = t
                    .segments
                    .iter_mut()
                    .find(|s| s.mode == Mode::Transit && s.pieces.len() > 1)
                    .expect("a bend");
                let bend = segment.pieces[0].len() - 1;
                segment.pieces[0][bend][0] += 1e-9;
                segment.pieces[1][0][0] += 1e-9;
            }),
            "kept form",
        ),
        damage(
            "a piece is in a region that is not there",
            trajectory(|t| t.segments[0].regions[0] = 31_337),
            "does not exist",
        ),
        damage(
            "a piece jumps",
            trajectory(|t| {
                t.segments[2].pieces[0][0][1] += 1e-9;
            }),
            "does not begin",
        ),
        damage(
            "the pieces of a segment are gone",
            trajectory(|t| {
                t.segments[2].pieces.clear();
                t.segments[2].regions.clear();
            }),
            "no pieces",
        ),
        damage(
            "a control point is too short",
            trajectory(|t| {
                t.segments[2].pieces[0][0].pop();
            }),
            "finite numbers",
        ),
        damage("the coordinates are exchanged", trajectory(|t| t.coordinates.swap(0, 1)), "coordinates"),
        damage(
            "the end is not the goal",
            trajectory(|t| {
                let segment = t.segments.last_mut().expect("a segment");
                let piece = segment.pieces.last_mut().expect("a piece");
                let end = piece.len() - 1;
                piece[end][2] -= 1e-6;
            }),
            "does not end",
        ),
    ]
}
