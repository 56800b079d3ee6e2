//! Whole files as strings.
