//! The scene file as text: TOML to plain tables, names not yet resolved.

use crate::error::SceneError;
use serde::Deserialize;
use std::collections::BTreeMap;

/// `scene.toml`. Unknown keys are errors.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Document {
    #[serde(rename = "format")]
    _format: i64,
    pub name: String,
    #[serde(default)]
    pub description: String,
    #[serde(default, rename = "model")]
    pub models: Vec<ModelTable>,
    #[serde(default, rename = "obstacle")]
    pub obstacles: Vec<ObstacleTable>,
    pub coordinates: CoordinatesTable,
    #[serde(default)]
    pub collision: CollisionTable,
    #[serde(default, rename = "task")]
    pub tasks: BTreeMap<String, TaskTable>,
}

/// `[[model]]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModelTable {
    pub name: String,
    pub role: RoleName,
    pub urdf: String,
    #[serde(default)]
    pub xyz: [f64; 3],
    #[serde(default)]
    pub rpy: [f64; 3],
}

/// `role` of a model.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RoleName {
    Robot,
    Object,
    Obstacle,
}

/// `[[obstacle]]`: exactly one shape.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObstacleTable {
    pub name: String,
    #[serde(default)]
    pub xyz: [f64; 3],
    #[serde(default)]
    pub rpy: [f64; 3],
    #[serde(rename = "box")]
    pub cuboid: Option<BoxTable>,
    pub cylinder: Option<RoundTable>,
    pub sphere: Option<SphereTable>,
    pub capsule: Option<RoundTable>,
}

/// `box = { size = [x, y, z] }`, full lengths.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxTable {
    pub size: [f64; 3],
}

/// `cylinder` or `capsule`: `{ radius, length }`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoundTable {
    pub radius: f64,
    pub length: f64,
}

/// `sphere = { radius }`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SphereTable {
    pub radius: f64,
}

/// `[coordinates]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CoordinatesTable {
    pub order: Vec<String>,
    #[serde(default)]
    pub limits: BTreeMap<String, [f64; 2]>,
}

/// `[collision]`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CollisionTable {
    #[serde(default)]
    pub exclude: Vec<[String; 2]>,
}

/// A form by coordinate name.
pub type FormTable = BTreeMap<String, f64>;

/// `[task.NAME]`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskTable {
    pub start: Vec<f64>,
    pub goal: Vec<f64>,
    pub max_grasps: usize,
    #[serde(default)]
    pub clearance: f64,
    #[serde(default)]
    pub grasp: SpaceTable,
    #[serde(default)]
    pub placement: SpaceTable,
    pub transfer: KeepTable,
    /// Default: every coordinate of the models with role object.
    pub transit: Option<KeepTable>,
}

/// `grasp` or `placement`; empty means the joint box.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpaceTable {
    #[serde(default)]
    pub bounds: BTreeMap<String, [f64; 2]>,
    #[serde(default)]
    pub rows: Vec<RowTable>,
}

/// A row; a side that is left out is unbounded.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RowTable {
    pub form: FormTable,
    pub lower: Option<f64>,
    pub upper: Option<f64>,
}

/// `transfer` or `transit`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeepTable {
    pub keep: Vec<FormTable>,
}

/// Only the version: read first, so that a file of a later format is refused for that reason.
#[derive(Deserialize)]
struct FormatOnly {
    format: Option<toml::Value>,
}

/// Parses `text`, the content of `file`.
pub fn parse(file: &str, text: &str) -> Result<Document, SceneError> {
    let toml_error = |error: toml::de::Error| {
        let offset = error.span().map_or(0, |span| span.start).min(text.len());
        let line_idx = text.as_bytes()[..offset].iter().filter(|&&byte| byte == b'\n').count();
        let line: String = text.lines().nth(line_idx).unwrap_or("").trim().chars().take(120).collect();
        let message = error.message().trim().replace('\n', ", ");
        SceneError::Toml { file: file.to_owned(), line: line_idx + 1, text: line, message }
    };
    let version: FormatOnly = toml::from_str(text).map_err(toml_error)?;
    match version.format {
        Some(toml::Value::Integer(1)) => toml::from_str(text).map_err(toml_error),
        other => Err(SceneError::Format {
            file: file.to_owned(),
            found: other.map_or("(missing)".to_owned(), |value| value.to_string()),
        }),
    }
}
