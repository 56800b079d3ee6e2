//! The one integration-test binary.

/// The same picture for any number of threads, any crop, any accelerator; samples can be replayed.
mod determinism;
/// Integrators against closed forms, strategies against each other.
mod light_transport;
/// Layers, file lengths, unsafe code, printing.
mod tidy;
/// Shared helpers.
mod util;
