//! Tables of tasks to [`Task`]s: names resolved, the rules of a scene checked.

use crate::document::{FormTable, SpaceTable, TaskTable};
use crate::error::{Place, SceneError};
use crate::feasibility::prove_empty;
use crate::naming::CoordinateNames;
use crate::numbers::{Enclosure, finite};
use crate::{BoundedRow, Coordinate, LinearForm, Space, Task};
use nalgebra::DVector;

/// Smallest coefficient, in size, that makes a form: below it, scaling rows to unit length loses digits.
const MIN_COEFFICIENT: f64 = 1e-9;

/// What tasks refer to.
pub struct TaskReader<'a> {
    /// The coordinates in order.
    pub coordinates: &'a [Coordinate],
    /// Resolves names to movable joints.
    pub names: &'a CoordinateNames,
    /// For each movable joint its position among the coordinates.
    pub order_of: &'a [usize],
    /// For each coordinate whether a model with role object has it.
    pub is_object: &'a [bool],
    /// Names a field of the scene file.
    pub place: &'a dyn Fn(String) -> Place,
}

impl TaskReader<'_> {
    /// The task called `name`.
    pub fn task(&self, name: &str, table: &TaskTable) -> Result<Task, SceneError> {
        let at = |field: &str| (self.place)(format!("task.{name}.{field}"));
        if table.max_grasps == 0 {
            return Err(SceneError::NoGrasps { at: at("max_grasps"), value: 0 });
        }
        finite(at("clearance"), table.clearance)?;
        if table.clearance < 0.0 {
            return Err(SceneError::NegativeClearance { at: at("clearance"), value: table.clearance });
        }
        let start = self.configuration(|part| at(&format!("start{part}")), &table.start)?;
        let goal = self.configuration(|part| at(&format!("goal{part}")), &table.goal)?;
        let grasp = self.space(|part| at(&format!("grasp{part}")), "grasp space CG", &table.grasp)?;
        let placement =
            self.space(|part| at(&format!("placement{part}")), "placement space CP", &table.placement)?;
        self.require_inside(&at, "start", &start, &placement)?;
        self.require_inside(&at, "goal", &goal, &placement)?;
        let transfer_keep = self.forms(|part| at(&format!("transfer.keep{part}")), &table.transfer.keep)?;
        let transit_keep = match &table.transit {
            Some(keep) => self.forms(|part| at(&format!("transit.keep{part}")), &keep.keep)?,
            None => self.object_coordinates(),
        };
        Ok(Task {
            name: name.to_owned(),
            start,
            goal,
            max_grasps: table.max_grasps,
            clearance: table.clearance,
            grasp,
            placement,
            transfer_keep,
            transit_keep,
        })
    }

    fn dim(&self) -> usize {
        self.coordinates.len()
    }

    fn configuration(&self, at: impl Fn(&str) -> Place, q: &[f64]) -> Result<DVector<f64>, SceneError> {
        if q.len() != self.dim() {
            return Err(SceneError::Dimension { at: at(""), found: q.len(), expected: self.dim() });
        }
        for (idx, &value) in q.iter().enumerate() {
            finite(at(&format!("[{idx}]")), value)?;
        }
        Ok(DVector::from_column_slice(q))
    }

    /// One coordinate each: what rests while the robot moves alone.
    fn object_coordinates(&self) -> Vec<LinearForm> {
        let objects = (0..self.dim()).filter(|&idx| self.is_object[idx]);
        objects.map(|idx| DVector::from_fn(self.dim(), |k, _| f64::from(k == idx))).collect()
    }

    fn forms(&self, at: impl Fn(&str) -> Place, tables: &[FormTable]) -> Result<Vec<LinearForm>, SceneError> {
        let form = |(idx, table)| self.form(|part| at(&format!("[{idx}]{part}")), table);
        tables.iter().enumerate().map(form).collect()
    }

    fn form(&self, at: impl Fn(&str) -> Place, table: &FormTable) -> Result<LinearForm, SceneError> {
        let mut form = DVector::zeros(self.dim());
        for (movable_idx, (name, &value)) in
            self.names.resolve_table(table, |name| at(&format!(".{name}")))?
        {
            form[self.order_of[movable_idx]] = finite(at(&format!(".{name}")), value)?;
        }
        if form.amax() < MIN_COEFFICIENT {
            return Err(SceneError::ZeroForm { at: at(""), value: format!("{table:?}") });
        }
        Ok(form)
    }

    fn space(
        &self,
        at: impl Fn(&str) -> Place,
        space_name: &'static str,
        table: &SpaceTable,
    ) -> Result<Space, SceneError> {
        let mut space = Space {
            lower: DVector::from_iterator(self.dim(), self.coordinates.iter().map(|c| c.lower)),
            upper: DVector::from_iterator(self.dim(), self.coordinates.iter().map(|c| c.upper)),
            rows: Vec::with_capacity(table.rows.len()),
        };
        let at_bound = |name: &str| at(&format!(".bounds.{name}"));
        for (movable_idx, (name, &[lower, upper])) in self.names.resolve_table(&table.bounds, at_bound)? {
            let idx = self.order_of[movable_idx];
            finite(at_bound(name), lower)?;
            finite(at_bound(name), upper)?;
            if lower > upper {
                return Err(SceneError::NotOrdered { at: at_bound(name), lower, upper });
            }
            let Coordinate { lower: limit_lower, upper: limit_upper, .. } = self.coordinates[idx];
            if lower < limit_lower || upper > limit_upper {
                let at = at_bound(name);
                return Err(SceneError::OutsideLimits { at, lower, upper, limit_lower, limit_upper });
            }
            space.lower[idx] = lower;
            space.upper[idx] = upper;
        }
        for (row_idx, row) in table.rows.iter().enumerate() {
            let at_row = |part: &str| at(&format!(".rows[{row_idx}]{part}"));
            let form = self.form(|part| at_row(&format!(".form{part}")), &row.form)?;
            let side = |part: &str, value: Option<f64>| value.map(|v| finite(at_row(part), v)).transpose();
            let (lower, upper) = (side(".lower", row.lower)?, side(".upper", row.upper)?);
            if lower.is_none() && upper.is_none() {
                return Err(SceneError::UnboundedRow { at: at_row("") });
            }
            let lower = lower.unwrap_or(f64::NEG_INFINITY);
            let upper = upper.unwrap_or(f64::INFINITY);
            if lower > upper {
                return Err(SceneError::NotOrdered { at: at_row(""), lower, upper });
            }
            space.rows.push(BoundedRow { form, lower, upper });
        }
        match prove_empty(&space) {
            None => Ok(space),
            Some(rows) => {
                let rows: Vec<String> = rows.iter().map(|row| format!("rows[{row}]")).collect();
                let reason = match rows.as_slice() {
                    [row] => format!("{row} cannot hold within the bounds"),
                    _ => format!("{} contradict each other within the bounds", rows.join(", ")),
                };
                Err(SceneError::EmptySpace { at: at(""), space: space_name, reason })
            }
        }
    }

    /// Refuses `q` only if it is outside `placement` beyond the rounding of the rows' values.
    fn require_inside(
        &self,
        at: &dyn Fn(&str) -> Place,
        field: &str,
        q: &DVector<f64>,
        placement: &Space,
    ) -> Result<(), SceneError> {
        for (idx, &value) in q.iter().enumerate() {
            let (lower, upper) = (placement.lower[idx], placement.upper[idx]);
            if value < lower || value > upper {
                let at = at(&format!("{field}[{idx}]"));
                let reason = format!("{} lies in [{lower}, {upper}]", self.coordinates[idx].name);
                return Err(SceneError::OutsidePlacement { at, value: value.to_string(), reason });
            }
        }
        for (row_idx, row) in placement.rows.iter().enumerate() {
            let exact = |values: &DVector<f64>| -> Vec<Enclosure> {
                values.iter().map(|&value| Enclosure::exact(value)).collect()
            };
            let value = Enclosure::dot(exact(&row.form).into_iter(), exact(q).into_iter());
            if value.upper < row.lower || value.lower > row.upper {
                let reason = format!(
                    "rows[{row_idx}] has the value {} there and lies in [{}, {}]",
                    row.form.dot(q),
                    row.lower,
                    row.upper
                );
                let value = format!("{:?}", q.as_slice());
                return Err(SceneError::OutsidePlacement { at: at(field), value, reason });
            }
        }
        Ok(())
    }
}
