//! Convex regions of the collision-free configuration space.

mod earlier_run;
mod stage;

fn main() -> std::process::ExitCode {
    stage_kit::main::<stage::DecomposeStage>()
}
