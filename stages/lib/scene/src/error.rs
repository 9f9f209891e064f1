//! Why a scene is refused: each message names file, field, value and remedy.

use std::fmt;

/// Where in the input something is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file, as the user can open it.
    pub file: String,
    /// The field in it: `task.open.start[0]`, `joint "cap" limit`.
    pub field: String,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.file, self.field)
    }
}

/// A scene that cannot be used (exit code 2).
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // The messages say what the fields are.
pub enum SceneError {
    #[error("{file}: cannot be read: {source}; give a scene folder or the scene.toml in it")]
    Unreadable { file: String, source: std::io::Error },
    #[error("{at} = \"{value}\": {path} cannot be read: {source}; put the file there or correct the path")]
    UrdfUnreadable { at: Place, value: String, path: String, source: std::io::Error },
    #[error("{at} = \"{value}\": leaves the scene folder; copy the file into it and give its relative path")]
    UrdfOutsideFolder { at: Place, value: String },
    #[error("{file}: byte {offset} is not UTF-8; save the file as UTF-8 text")]
    NotUtf8 { file: String, offset: usize },
    #[error("{file}: line {line}, `{text}`: {message}; correct this line")]
    Toml { file: String, line: usize, text: String, message: String },
    #[error("{file}: not a URDF that can be read: {message}; correct it (`check_urdf` may help)")]
    Urdf { file: String, message: String },
    #[error("{file}: format = {found}: this version reads format 1; write `format = 1`")]
    Format { file: String, found: String },
    #[error(
        "{at} = \"{value}\": not a usable name; use letters, digits, `_`, `-` and `.`, not beginning with a `.`"
    )]
    BadName { at: Place, value: String },
    #[error("{at} = \"{value}\": this name is taken; names are unique, choose another")]
    DuplicateName { at: Place, value: String },
    #[error("{at} = {value}: not a finite number; give a finite one")]
    NotFinite { at: Place, value: f64 },
    #[error("{at} = {value}: larger than 1e6 in size; lengths are in metres, angles in radians")]
    TooLarge { at: Place, value: f64 },
    #[error("{at} = {value}: not greater than zero; give a positive size, or leave the shape out")]
    NotPositive { at: Place, value: f64 },
    #[error("{at} = {value}: negative; give a distance of at least 0 metres")]
    NegativeClearance { at: Place, value: f64 },
    #[error("{at} = {value}: a task needs at least one grasp; give 1 or more")]
    NoGrasps { at: Place, value: usize },
    #[error("{at} = [{lower}, {upper}]: the lower bound is not below the upper one; exchange or widen them")]
    NotOrdered { at: Place, lower: f64, upper: f64 },
    #[error(
        "{at} = [{lower}, {upper}]: not inside the limits [{limit_lower}, {limit_upper}] of the joint; narrow it"
    )]
    OutsideLimits { at: Place, lower: f64, upper: f64, limit_lower: f64, limit_upper: f64 },
    #[error(
        "{at} = [{lower}, {upper}]: a revolute range lies inside (-pi, pi); narrow it by `limits` in [coordinates]"
    )]
    RevoluteRange { at: Place, lower: f64, upper: f64 },
    #[error(
        "{at}: {kind} joint `{name}` has no range; add `limits = {{ \"{name}\" = [lower, upper] }}` there"
    )]
    LimitsNeeded { at: Place, kind: &'static str, name: String },
    #[error("{at} = {value}: the scene has no such coordinate; it has {known}")]
    UnknownCoordinate { at: Place, value: String, known: String },
    #[error("{at} = {value}: several joints have this name; write one of {known}")]
    AmbiguousCoordinate { at: Place, value: String, known: String },
    #[error("{at} = {value}: named twice (a joint may also be spelled model/joint); name each joint once")]
    RepeatedCoordinate { at: Place, value: String },
    #[error("{at}: joint `{value}` can move and is not named; add \"{value}\" to the order")]
    CoordinateMissing { at: Place, value: String },
    #[error("{at} = []: nothing in the scene can move; add a model with a movable joint")]
    NoCoordinates { at: Place },
    #[error("{at} has {found} of box, cylinder, sphere, capsule; give exactly one")]
    ShapeCount { at: Place, found: usize },
    #[error(
        "{at} of link `{link}` of model `{model}`: {kind} is not supported as a collision shape; {remedy}"
    )]
    UnsupportedShape { at: Place, model: Box<str>, link: Box<str>, kind: &'static str, remedy: &'static str },
    #[error("{at} = \"{kind}\" of joint `{joint}` of model `{model}`: this kind is not supported; {remedy}")]
    UnsupportedJoint { at: Place, model: Box<str>, joint: Box<str>, kind: &'static str, remedy: &'static str },
    #[error("{at} = \"{value}\": no link of this name in the file; {remedy}")]
    UnknownUrdfLink { at: Place, value: String, remedy: &'static str },
    #[error("{at} = \"{value}\": this link is the child of two joints; a tree needs one parent a link")]
    TwoParents { at: Place, value: String },
    #[error(
        "{at}: {found} links have no parent ({names}); a tree has exactly one root, join or remove links"
    )]
    Roots { at: Place, found: usize, names: String },
    #[error("{at}: the joints form a cycle through link `{value}`; remove a joint of it")]
    Cycle { at: Place, value: String },
    #[error("{at} = {value}: the axis has no direction; give one that is not zero")]
    ZeroAxis { at: Place, value: String },
    #[error("{at} = \"{value}\": no such link or obstacle; there are {known}")]
    UnknownLink { at: Place, value: String, known: String },
    #[error("{at} = \"{value}\": a link is paired with itself; name two different ones")]
    ExcludedWithItself { at: Place, value: String },
    #[error(
        "{at} has {found} numbers, the scene has {expected} coordinates; give one a coordinate, in order"
    )]
    Dimension { at: Place, found: usize, expected: usize },
    #[error(
        "{at} = {value}: the form is zero (no coefficient of at least 1e-9); give a coefficient or remove it"
    )]
    ZeroForm { at: Place, value: String },
    #[error("{at}: the row has neither lower nor upper; give at least one")]
    UnboundedRow { at: Place },
    #[error("{at} = {value}: outside the placement space: {reason}; move it or widen `placement`")]
    OutsidePlacement { at: Place, value: String, reason: String },
    #[error("{at}: {space} is empty in the joint box: {reason}; widen its bounds or rows")]
    EmptySpace { at: Place, space: &'static str, reason: String },
    #[error("{file}: task = \"{name}\": the scene has no such task; it has {known}")]
    UnknownTask { file: String, name: String, known: String },
    #[error("{file}: task: the scene has several, choose one by --task: {known}")]
    TaskNeeded { file: String, known: String },
    #[error(
        "{file}: task: the scene has none; add a table [task.NAME] (a scene without tasks has regions only)"
    )]
    NoTask { file: String },
}

/// Names for a message: `a, b, c`.
pub(crate) fn listed<S: AsRef<str>>(names: impl IntoIterator<Item = S>) -> String {
    let names: Vec<String> = names.into_iter().map(|name| name.as_ref().to_owned()).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
