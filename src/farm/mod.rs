//! What render farms need: lines of progress in their formats, sequences of frames, job scripts for Slurm, job templates of Open Job Description.

mod frames;
mod progress;

pub use frames::{FrameList, file_of_frame, has_frame_pattern, is_scene_per_frame, scene_of_frame, with_frame_pattern};
pub use progress::{Event, FORMATS, Format, Status};
