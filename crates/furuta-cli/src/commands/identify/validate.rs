//! `furuta identify validate`: how well a rig file predicts recordings that it was not fitted to.

use furuta_ident::validate::{Options, validate_with};
use furuta_ident::{Pendulum, Task};
use furuta_model::Rig;

use crate::commands::recorded::{RecordedArgs, samples_used};
use crate::failure::Failure;

/// Judge a rig file by recordings that it was not fitted to: fit in per cent, residual tests with their 99 % bounds,
/// errors after fixed times.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(flatten)]
    recorded: RecordedArgs,
    /// What the pendulum did in DATA: swings; removed (taken off) or locked (hanging, held to the arm), so that the arm
    /// alone is looked at; alone (it swings, the arm is held) or driven (it swings, the arm moves as theta says), so
    /// that the pendulum is.
    #[arg(long, value_name = "STATE", default_value = "swings")]
    pendulum: Pendulum,
    /// All recordings count their angles from the rig's zeros: no encoder was switched off between them. Otherwise each
    /// has zeros of its own.
    #[arg(long)]
    same_zero: bool,
}

/// Runs the command.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let rig = Rig::load(&args.recorded.rig)?;
    let mut notices = Vec::new();
    let [data, _] = args.recorded.load(&rig, &[], args.pendulum, &mut notices)?;
    args.recorded.foretell(Task::Validate, samples_used(&data));
    let options = Options {
        pendulum: args.pendulum,
        same_zero: args.same_zero,
    };
    let mut validation = validate_with(&data, &rig, options)?;
    validation.notices.splice(0..0, notices);
    args.recorded
        .answer(|| validation.to_json(), || validation.summary())
}
