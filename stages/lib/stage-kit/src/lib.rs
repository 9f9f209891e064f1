//! Harness of a stage: command line, files, channels, progress, exit codes.
