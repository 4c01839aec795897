//! All tests of the crate as one program: linked once, run side by side.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod calibrate;
mod compare;
mod desk;
mod documented_commands;
mod exit_codes;
mod explain;
mod fleet;
mod from_a_room_to_lengths;
mod from_boards_to_a_room;
mod hostile;
mod inputs_are_kept;
mod live;
mod long_surveys;
mod noise;
mod pictures;
mod register;
mod warm_up;
