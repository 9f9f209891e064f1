//! Paths of any planner, as files: a table of configurations (`.csv`) or Bézier curves (`.json`).
//!
//! The table has a header with every coordinate by name, in any order, and optionally `t` (not falling) and `mode`
//! (`transit` or `transfer`). Its rows are joined by straight lines; the mode of a row holds from it to the next one.
//! The curves are those of `trajectory.json`: `{"coordinates", "segments": [{"mode", "pieces": [[[…]…]…]}]}`; further
//! fields are not read, and `mode` may be missing.

use crate::artefact::Mode;
use serde::Deserialize;
use std::path::Path;

/// Most control points of a piece. A curve of higher order is to be cut up by its planner.
pub const MAX_CONTROL_POINTS: usize = 64;

/// Longest file that is read, bytes.
pub const MAX_FILE_BYTES: u64 = 1 << 30;

/// A piece of a path: a Bézier curve.
#[derive(Debug, Clone, PartialEq)]
pub struct InputPiece {
    /// Where it stands in the file.
    pub place: String,
    /// Whether the object rests or is held, if the file says so.
    pub mode: Option<Mode>,
    /// Control points (at least 2), each with the coordinates in the order that was asked for.
    pub control_points: Vec<Vec<f64>>,
}

/// A path file that cannot be used.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)] // The messages say what the fields are.
pub enum PathInputError {
    #[error("{file}: cannot be read: {source}")]
    Read { file: String, source: std::io::Error },
    #[error("{file}: {bytes} bytes, at most {MAX_FILE_BYTES} are read; cut the path up")]
    TooLarge { file: String, bytes: u64 },
    #[error("{file}: {problem}; a path is a header with every coordinate and at least one row")]
    Empty { file: String, problem: &'static str },
    #[error("{file}:1: unknown column `{name}`; known are t, mode and the coordinates {known}")]
    UnknownColumn { file: String, name: String, known: String },
    #[error("{file}:1: column `{name}` stands twice; keep one of them")]
    TwiceColumn { file: String, name: String },
    #[error("{file}:1: column `{name}` is missing; every coordinate of the scene is needed ({known})")]
    MissingColumn { file: String, name: String, known: String },
    #[error("{file}:{line}: {found} fields, expected {expected}, one a column of the header")]
    Fields { file: String, line: usize, found: usize, expected: usize },
    #[error("{file}:{line}: column `{name}`: `{value}` is not a finite number; correct it")]
    Number { file: String, line: usize, name: String, value: String },
    #[error("{file}:{line}: column `mode`: `{value}` is neither transit nor transfer; correct it")]
    Mode { file: String, line: usize, value: String },
    #[error("{file}:{line}: column `t`: {value} is less than in the row before; sort the rows")]
    Falling { file: String, line: usize, value: f64 },
    #[error("{file}: {source}; expected {{\"coordinates\": […], \"segments\": [{{\"pieces\": […]}}]}}")]
    Json { file: String, source: serde_json::Error },
    #[error("{file}: {field} = {value}: expected {expected}")]
    Curve { file: String, field: String, value: String, expected: String },
}

/// Reads the path in `file`, a `.json` or else a table, over the coordinates of these names.
pub fn read(file: &Path, coordinates: &[String]) -> Result<Vec<InputPiece>, PathInputError> {
    let name = file.display().to_string();
    let unreadable = |source| PathInputError::Read { file: name.clone(), source };
    let bytes = std::fs::metadata(file).map_err(unreadable)?.len();
    if bytes > MAX_FILE_BYTES {
        return Err(PathInputError::TooLarge { file: name, bytes });
    }
    let text = std::fs::read_to_string(file).map_err(unreadable)?;
    if file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json")) {
        parse_curves(&name, &text, coordinates)
    } else {
        parse_table(&name, &text, coordinates)
    }
}

/// What a column of the table holds.
enum Column {
    Time,
    Mode,
    Coordinate(usize),
}

/// The path in the table `text`; `file` names it in errors. A single row is a path that stays where it is.
pub fn parse_table(
    file: &str,
    text: &str,
    coordinates: &[String],
) -> Result<Vec<InputPiece>, PathInputError> {
    let file = || file.to_owned();
    // A byte order mark is no part of the first name.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text.lines().enumerate().map(|(line_idx, line)| (line_idx + 1, line));
    let (_, header) = lines.next().ok_or(PathInputError::Empty { file: file(), problem: "it is empty" })?;
    let columns = parse_header(&file(), header, coordinates)?;
    let names: Vec<&str> = header.split(',').map(unquoted).collect();
    let mut rows: Vec<(usize, Option<Mode>, Vec<f64>)> = Vec::new();
    let mut last_time = f64::NEG_INFINITY;
    for (line, row) in lines.filter(|(_, row)| !row.trim().is_empty()) {
        let fields: Vec<&str> = row.split(',').map(unquoted).collect();
        if fields.len() != columns.len() {
            let (found, expected) = (fields.len(), columns.len());
            return Err(PathInputError::Fields { file: file(), line, found, expected });
        }
        let (mut mode, mut q) = (None, vec![0.0; coordinates.len()]);
        for ((column, field), name) in columns.iter().zip(&fields).zip(&names) {
            let number = || match field.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => {
                    let (name, value) = ((*name).to_owned(), (*field).to_owned());
                    Err(PathInputError::Number { file: file(), line, name, value })
                }
            };
            match column {
                Column::Coordinate(coordinate_idx) => q[*coordinate_idx] = number()?,
                Column::Time => {
                    let value = number()?;
                    if value < last_time {
                        return Err(PathInputError::Falling { file: file(), line, value });
                    }
                    last_time = value;
                }
                Column::Mode => {
                    let known =
                        [Mode::Transit, Mode::Transfer].into_iter().find(|mode| mode.word() == *field);
                    let value = (*field).to_owned();
                    mode = Some(known.ok_or(PathInputError::Mode { file: file(), line, value })?);
                }
            }
        }
        rows.push((line, mode, q));
    }
    let piece = |line: usize, mode, from: &[f64], to: &[f64]| InputPiece {
        place: format!("line {line}"),
        mode,
        control_points: vec![from.to_vec(), to.to_vec()],
    };
    match rows.as_slice() {
        [] => Err(PathInputError::Empty { file: file(), problem: "it has no rows" }),
        [(line, mode, q)] => Ok(vec![piece(*line, *mode, q, q)]),
        rows => Ok(rows.windows(2).map(|pair| piece(pair[0].0, pair[0].1, &pair[0].2, &pair[1].2)).collect()),
    }
}

fn unquoted(field: &str) -> &str {
    let field = field.trim();
    field.strip_prefix('"').and_then(|inner| inner.strip_suffix('"')).unwrap_or(field)
}

fn parse_header(file: &str, header: &str, coordinates: &[String]) -> Result<Vec<Column>, PathInputError> {
    let file = || file.to_owned();
    let known = || coordinates.join(", ");
    let names: Vec<&str> = header.split(',').map(unquoted).collect();
    for (position, name) in names.iter().enumerate() {
        if names[..position].contains(name) {
            return Err(PathInputError::TwiceColumn { file: file(), name: (*name).to_owned() });
        }
    }
    if let Some(missing) = coordinates.iter().find(|name| !names.contains(&name.as_str())) {
        return Err(PathInputError::MissingColumn { file: file(), name: missing.clone(), known: known() });
    }
    let column = |name: &&str| {
        // A coordinate may be called `t`; it comes first.
        match (coordinates.iter().position(|coordinate| coordinate == name), *name) {
            (Some(coordinate_idx), _) => Ok(Column::Coordinate(coordinate_idx)),
            (None, "t") => Ok(Column::Time),
            (None, "mode") => Ok(Column::Mode),
            (None, name) => {
                Err(PathInputError::UnknownColumn { file: file(), name: name.to_owned(), known: known() })
            }
        }
    };
    names.iter().map(column).collect()
}

#[derive(Deserialize)]
struct Curves {
    coordinates: Vec<String>,
    segments: Vec<CurveSegment>,
}

#[derive(Deserialize)]
struct CurveSegment {
    #[serde(default)]
    mode: Option<Mode>,
    pieces: Vec<Vec<Vec<f64>>>,
}

/// The path in the curves `text`; `file` names it in errors.
pub fn parse_curves(
    file: &str,
    text: &str,
    coordinates: &[String],
) -> Result<Vec<InputPiece>, PathInputError> {
    let broken = |field: String, value: String, expected: String| PathInputError::Curve {
        file: file.to_owned(),
        field,
        value,
        expected,
    };
    let curves: Curves = serde_json::from_str(text)
        .map_err(|source| PathInputError::Json { file: file.to_owned(), source })?;
    let n = coordinates.len();
    let mut sorted = [curves.coordinates.clone(), coordinates.to_vec()];
    sorted.iter_mut().for_each(|names| names.sort_unstable());
    if sorted[0] != sorted[1] {
        let [found, expected] = [&curves.coordinates[..], coordinates].map(|names| names.join(", "));
        let expected = format!("those of the scene in any order, [{expected}]");
        return Err(broken("coordinates".into(), format!("[{found}]"), expected));
    }
    // Scene position of each of the file's coordinates.
    let order: Vec<usize> =
        curves.coordinates.iter().filter_map(|name| coordinates.iter().position(|c| c == name)).collect();
    let mut pieces = Vec::new();
    for (segment_idx, segment) in curves.segments.iter().enumerate() {
        for (piece_idx, piece) in segment.pieces.iter().enumerate() {
            let place = format!("segments[{segment_idx}].pieces[{piece_idx}]");
            if !(2..=MAX_CONTROL_POINTS).contains(&piece.len()) {
                let expected = format!("2 to {MAX_CONTROL_POINTS} control points");
                return Err(broken(format!("length of {place}"), piece.len().to_string(), expected));
            }
            let mut control_points = vec![vec![0.0; n]; piece.len()];
            for (point_idx, point) in piece.iter().enumerate() {
                if point.len() != n {
                    let field = format!("length of {place}[{point_idx}]");
                    return Err(broken(field, point.len().to_string(), format!("{n}, one a coordinate")));
                }
                for (position, &value) in point.iter().enumerate() {
                    if !value.is_finite() {
                        let field = format!("{place}[{point_idx}][{position}]");
                        return Err(broken(field, value.to_string(), "a finite number".into()));
                    }
                    control_points[point_idx][order[position]] = value;
                }
            }
            pieces.push(InputPiece { place, mode: segment.mode, control_points });
        }
    }
    if pieces.is_empty() {
        return Err(PathInputError::Empty { file: file.to_owned(), problem: "it has no pieces" });
    }
    Ok(pieces)
}

#[cfg(test)]
mod tests;
