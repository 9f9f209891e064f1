//! Regions of an earlier run, from its files.

use ipc_types::artefact::RegionsFile;
use ipc_types::store::find_artefact;
use ipc_types::validate;
use std::path::Path;
use wire::Region;

/// The certified regions of the run in `folder`, or its candidates if nothing was certified. The scene may have been
/// another one, with the same `coordinates`. Errors say which file, what is wrong, and what to do.
pub(crate) fn regions_of_run(folder: &Path, coordinates: &[String]) -> Result<Vec<Region>, String> {
    let find = |stage: &str| {
        let file = find_artefact::<RegionsFile>(&folder.join(stage), "regions", None);
        file.map_err(|error| error.to_string())
    };
    let (stage, file) = match find("certify")?.filter(|file| !file.regions.is_empty()) {
        Some(file) => ("certify", Some(file)),
        None => ("decompose", find("decompose")?),
    };
    let name = folder.join(stage).join("regions");
    let Some(file) = file else {
        return Err(format!(
            "--extend {}: neither certify/regions nor decompose/regions is there; give the folder of a run",
            folder.display()
        ));
    };
    if file.coordinates != coordinates {
        return Err(format!(
            "--extend: {} has the coordinates {:?}, the scene has {coordinates:?}; only a run with the same can be \
             extended",
            name.display(),
            file.coordinates
        ));
    }
    validate::regions(&file, coordinates)
        .map_err(|rule| format!("--extend: {}: {rule}; run the stage that wrote it again", name.display()))?;
    let regions = file.regions.iter().map(|region| Region::from_artefact(region, coordinates.len()));
    regions.collect::<Result<_, _>>().map_err(|error| format!("--extend: {}: {error}", name.display()))
}
