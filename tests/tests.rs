//! The one integration-test binary.

/// Whatever a user gets wrong ends in one error with file and place.
mod bad_input;
/// The program as a user runs it: exit codes, what it writes, what it says.
mod cli;
/// The same picture for any number of threads, any crop, any accelerator; samples can be replayed.
mod determinism;
/// Integrators against closed forms, strategies against each other.
mod light_transport;
/// Meshes, comments, names and transforms of scene files, read as users write them.
mod scene_files;
/// Layers, file lengths, unsafe code, printing.
mod tidy;
/// Shared helpers.
mod util;
