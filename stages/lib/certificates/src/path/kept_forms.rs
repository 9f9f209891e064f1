//! Whether a path keeps what the task keeps in its modes: the grasp during a transfer, the object during a transit.

use ipc_types::artefact::Mode;
use scene::Task;

/// Follows a path and compares its forms with those at the beginning of the motion in the present mode.
#[derive(Debug, Clone)]
pub struct KeptForms<'a> {
    task: &'a Task,
    /// The present mode and the values of its forms where it began.
    began: Option<(Mode, Vec<f64>)>,
}

/// The form that a piece changes most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Position among the forms of the mode.
    pub form_idx: usize,
    /// Largest change over the control points, which bounds that over the curve.
    pub residual: f64,
}

impl<'a> KeptForms<'a> {
    /// At the beginning of a path.
    pub fn new(task: &'a Task) -> Self {
        Self { task, began: None }
    }

    /// The next piece; `None` if it has no mode, or the mode keeps nothing.
    pub fn next_piece(&mut self, mode: Option<Mode>, control_points: &[Vec<f64>]) -> Option<Residual> {
        let Some(mode) = mode else {
            self.began = None;
            return None;
        };
        let forms = match mode {
            Mode::Transit => &self.task.transit_keep,
            Mode::Transfer => &self.task.transfer_keep,
        };
        let value =
            |form_idx: usize, q: &[f64]| forms[form_idx].iter().zip(q).map(|(c, x)| c * x).sum::<f64>();
        if self.began.as_ref().is_none_or(|(present, _)| *present != mode) {
            let first = control_points.first()?;
            self.began = Some((mode, (0..forms.len()).map(|form_idx| value(form_idx, first)).collect()));
        }
        let (_, began) = self.began.as_ref()?;
        let residual = |form_idx: usize| {
            let changes = control_points.iter().map(|q| (value(form_idx, q) - began[form_idx]).abs());
            Residual { form_idx, residual: changes.fold(0.0, f64::max) }
        };
        (0..forms.len()).map(residual).max_by(|a, b| a.residual.total_cmp(&b.residual))
    }
}
