//! `specgen new`: a folder with a commented spec of the user's own platform and a simulated record of its legs, from some
//! fifteen answers.

use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, ValueEnum};
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_studies::begin::questions::QUESTIONS;
use specgen_studies::begin::{self, Answers};

use super::named::OutputFolder;

/// Arguments of `new`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::NEW)]
pub struct Arguments {
    /// Name of the platform, and of the folder that is made; a path makes it elsewhere.
    name: OutputFolder,
    /// Ask nothing: what is not given is as in this spec.
    #[arg(long, value_enum)]
    like: Option<Like>,
    #[command(flatten)]
    answers: AnswerArguments,
}

/// What a new spec begins as.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Like {
    /// Six gauges see the platform; position feedback and feed-forward in task space.
    Reference,
    /// Each leg has a gauge of its own, and feed-forward alone.
    Legs,
}

/// What was given on the command line, by option.
#[derive(Debug, Clone, Default)]
struct AnswerArguments(Answers);

impl FromArgMatches for AnswerArguments {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given =
            QUESTIONS.iter().filter_map(|one| Some((one.option, matches.get_one::<String>(one.option)?.clone())));
        Ok(Self(given.collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for AnswerArguments {
    fn augment_args(command: Command) -> Command {
        QUESTIONS.iter().fold(command, |command, one| {
            let help = format!("{}, such as {}", one.text, one.example());
            command.arg(
                Arg::new(one.option)
                    .long(one.option)
                    .aliases(one.aliases.iter().copied())
                    .value_name("VALUE")
                    .action(ArgAction::Set)
                    .allow_hyphen_values(true)
                    .help(help),
            )
        })
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

pub fn run(arguments: &Arguments, ui: &mut Ui) -> Result<(), Failure> {
    let Arguments { name, like, answers: AnswerArguments(answers) } = arguments;
    begin::run(name, *like == Some(Like::Legs), like.is_none(), answers, ui)
}
