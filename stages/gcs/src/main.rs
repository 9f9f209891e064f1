//! Shortest transit and transfer paths in graphs of convex sets.

fn main() -> std::process::ExitCode {
    stage_kit::main::<gcs::GcsStage>()
}
