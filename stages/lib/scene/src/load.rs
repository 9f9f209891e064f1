//! Files to a [`Scene`].

use crate::document::{self, Document};
use crate::error::{Place, SceneError};
use crate::naming::CoordinateNames;
use crate::reading_tasks::TaskReader;
use crate::tree::CompositeTree;
use crate::urdf;
use crate::{Motion, Role, Scene, SceneFile, Task, ordering};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Component, Path};

/// Name of the scene file among [`Scene::files`], whatever it is called on disk.
pub const SCENE_FILE: &str = "scene.toml";

/// Largest file that is read, in bytes.
const MAX_FILE_BYTES: u64 = 64 << 20;

impl Scene {
    /// Reads the scene in the folder `path`, or the scene file `path`.
    ///
    /// Everything is checked that needs no collision checking: a scene that loads keeps the rules of
    /// [`Scene`] and [`Task`], but start and goal may be in collision.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let scene_file = if path.is_dir() { path.join(SCENE_FILE) } else { path.to_owned() };
        let folder = scene_file.parent().unwrap_or(Path::new("")).to_owned();
        let file = scene_file.display().to_string();
        let bytes =
            read(&scene_file).map_err(|source| SceneError::Unreadable { file: file.clone(), source })?;
        assemble(
            bytes,
            &|name| if name == SCENE_FILE { file.clone() } else { folder.join(name).display().to_string() },
            &|name| read(&folder.join(name)),
        )
    }

    /// The scene with the given `scene.toml` and URDF files, each a name and a text; for scenes made by
    /// programs and tests.
    pub fn from_text(scene_toml: &str, urdf: &[(&str, &str)]) -> Result<Self, SceneError> {
        let find = |name: &str| {
            let file = urdf.iter().find(|(file_name, _)| *file_name == name);
            file.map(|(_, text)| text.as_bytes().to_vec()).ok_or(io::Error::from(io::ErrorKind::NotFound))
        };
        assemble(scene_toml.as_bytes().to_vec(), &str::to_owned, &find)
    }
}

/// Reads a regular file of bounded size.
fn read(path: &Path) -> io::Result<Vec<u8>> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        return Err(io::Error::other("not a file"));
    }
    if metadata.len() > MAX_FILE_BYTES {
        return Err(io::Error::other(format!("{} bytes, at most {MAX_FILE_BYTES} are read", metadata.len())));
    }
    std::fs::read(path)
}

/// Builds the scene from the bytes of its file; `shown` names a file for messages, `read` reads one by the
/// name that the scene gives it.
fn assemble(
    scene_bytes: Vec<u8>,
    shown: &dyn Fn(&str) -> String,
    read: &dyn Fn(&str) -> io::Result<Vec<u8>>,
) -> Result<Scene, SceneError> {
    let scene_file = shown(SCENE_FILE);
    let place = |field: String| Place { file: scene_file.clone(), field };
    let text = std::str::from_utf8(&scene_bytes)
        .map_err(|error| SceneError::NotUtf8 { file: scene_file.clone(), offset: error.valid_up_to() })?;
    let document = document::parse(&scene_file, text)?;
    check_names(&document, &place)?;

    let mut files = BTreeMap::new();
    let mut trees = Vec::with_capacity(document.models.len());
    for model in &document.models {
        let at = || place(format!("model.{}.urdf", model.name));
        let name = relative_name(at, &model.urdf)?;
        if !files.contains_key(&name) {
            let bytes = read(&name).map_err(|source| {
                let (value, path) = (model.urdf.clone(), shown(&name));
                SceneError::UrdfUnreadable { at: at(), value, path, source }
            })?;
            files.insert(name.clone(), bytes);
        }
        trees.push(urdf::parse(&shown(&name), &model.name, &files[&name])?);
    }

    let CompositeTree { mut links, bodies, movable, adjacent_links, excluded_links } =
        CompositeTree::build(&document, trees, &place)?;
    let names = CoordinateNames::new(&movable);
    let (coordinates, order_of) = ordering::coordinates(&document.coordinates, &movable, &names, &place)?;
    for link in &mut links {
        if let Motion::Revolute { coordinate_idx, .. } | Motion::Prismatic { coordinate_idx, .. } =
            &mut link.motion
        {
            *coordinate_idx = order_of[*coordinate_idx];
        }
    }

    let mut is_object = vec![false; coordinates.len()];
    for (joint, &idx) in movable.iter().zip(&order_of) {
        is_object[idx] = joint.role == Role::Object;
    }
    let reader = TaskReader {
        coordinates: &coordinates,
        names: &names,
        order_of: &order_of,
        is_object: &is_object,
        place: &place,
    };
    let tasks: BTreeMap<String, Task> = document
        .tasks
        .iter()
        .map(|(name, table)| Ok((name.clone(), reader.task(name, table)?)))
        .collect::<Result<_, SceneError>>()?;

    files.insert(SCENE_FILE.to_owned(), scene_bytes);
    let files: Vec<SceneFile> = files.into_iter().map(|(name, bytes)| SceneFile { name, bytes }).collect();
    let digest = digest(&files);
    Ok(Scene {
        name: document.name,
        description: document.description,
        coordinates,
        links,
        bodies,
        adjacent_links,
        excluded_links,
        tasks,
        files,
        digest,
    })
}

/// BLAKE3 over the files, in the order given: the name in UTF-8, the length as 8 bytes little-endian, the bytes.
fn digest(files: &[SceneFile]) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    for file in files {
        hasher.update(file.name.as_bytes());
        hasher.update(&(file.bytes.len() as u64).to_le_bytes());
        hasher.update(&file.bytes);
    }
    *hasher.finalize().as_bytes()
}

/// The scene's name is a folder's name in `runs/`, the others are parts of names of links and fields.
fn check_names(document: &Document, place: &dyn Fn(String) -> Place) -> Result<(), SceneError> {
    let usable = |name: &str| {
        let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
        !name.is_empty() && !name.starts_with('.') && name.chars().all(allowed)
    };
    let models = document.models.iter().enumerate().map(|(idx, m)| (format!("model[{idx}].name"), &m.name));
    let obstacles =
        document.obstacles.iter().enumerate().map(|(idx, o)| (format!("obstacle[{idx}].name"), &o.name));
    let tasks = document.tasks.keys().map(|name| (format!("task.{name}"), name));
    let all = std::iter::once(("name".to_owned(), &document.name)).chain(models).chain(obstacles);
    let mut taken = BTreeSet::from(["world"]);
    for (field, name) in all.chain(tasks) {
        let scene_or_task = field == "name" || field.starts_with("task.");
        if !usable(name) {
            return Err(SceneError::BadName { at: place(field), value: name.clone() });
        }
        if !scene_or_task && !taken.insert(name) {
            return Err(SceneError::DuplicateName { at: place(field), value: name.clone() });
        }
    }
    Ok(())
}

/// `path` as a name relative to the scene folder, with `/`; a path that leaves the folder is refused, since a
/// run keeps copies of all files under their names.
fn relative_name(at: impl Fn() -> Place, path: &str) -> Result<String, SceneError> {
    let outside = || SceneError::UrdfOutsideFolder { at: at(), value: path.to_owned() };
    let mut parts = Vec::new();
    for component in Path::new(path).components() {
        match component {
            Component::Normal(part) => parts.push(part.to_str().ok_or_else(outside)?),
            Component::CurDir => {}
            _ => return Err(outside()),
        }
    }
    let name = parts.join("/");
    if name.is_empty() || name == SCENE_FILE || name.contains('\\') { Err(outside()) } else { Ok(name) }
}
