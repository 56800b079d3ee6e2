//! What render farms need: lines of progress in their formats, sequences of frames, job scripts for Slurm, job
//! templates of Open Job Description.

mod frames;
mod job;
mod openjd;
mod progress;
mod slurm;

pub use frames::{
    FrameList, check_single_name, file_of_frame, has_frame_pattern, is_scene_per_frame, scene_of_frame,
    with_frame_pattern,
};
pub use job::{Job, quote};
pub use openjd::openjd_template;
pub use progress::{Event, FORMATS, ProgressFormat, Status, message_line, message_lines};
pub use slurm::{Script, SlurmOptions, slurm_scripts};
