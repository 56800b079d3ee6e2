//! Switches of `render` that the environment, a configuration file or the scene may switch on have an opposite that
//! switches them off, such as `--no-denoise`. Of both the last one counts.

use clap::{Arg, ArgAction, Command};
use steradian::internal::config::{Trust, trust};

/// The name of a switch's opposite: `no-denoise` for `denoise`, `depth-of-field` for `no-depth-of-field`.
pub fn opposite(name: &str) -> String {
    name.strip_prefix("no-").map_or_else(|| format!("no-{name}"), str::to_owned)
}

/// The command with an opposite for each switch that may be on without the command line.
pub fn added(command: Command) -> Command {
    let is_switch = |arg: &&Arg| matches!(arg.get_action(), ArgAction::SetTrue);
    let names: Vec<String> = command
        .get_arguments()
        .filter(is_switch)
        .filter_map(Arg::get_long)
        .filter(|name| trust(name).is_some_and(|trust| trust < Trust::CommandLine))
        .map(str::to_owned)
        .collect();
    let id = |name: &str| name.replace('-', "_");
    names.into_iter().fold(command, |command, name| {
        let other = opposite(&name);
        let (own_id, other_id) = (id(&name), id(&other));
        let has_opposite = command.get_arguments().any(|arg| *arg.get_id() == *other_id);
        let command = command.mut_arg(&own_id, |arg| arg.overrides_with(other_id.clone()));
        if has_opposite {
            command.mut_arg(&other_id, |arg| arg.overrides_with(own_id))
        } else {
            command.arg(Arg::new(other_id).long(other).action(ArgAction::SetTrue).hide(true).overrides_with(own_id))
        }
    })
}
