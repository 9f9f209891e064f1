//! Fewest grasps: mixed-integer quadratic programme.

fn main() -> std::process::ExitCode {
    stage_kit::main::<miqp::MiqpStage>()
}
