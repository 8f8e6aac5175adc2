//! `specgen new`: creates a folder with a commented spec of the user's platform and a simulated record of its legs, from about
//! fifteen answers.

use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, ValueEnum};
use specgen_language::outcome::Failure;
use specgen_language::ui::Ui;
use specgen_studies::begin::questions::QUESTIONS;
use specgen_studies::begin::{self, Answers};

use super::path_roles::OutputFolder;

/// Arguments of `new`.
#[derive(Args, Debug)]
#[command(after_help = super::examples::NEW)]
pub struct Arguments {
    /// Name of the platform and of the new folder; a path creates the folder elsewhere.
    name: OutputFolder,
    /// Ask no questions: values that are not given as options are those of this template.
    #[arg(long, value_enum)]
    like: Option<Like>,
    #[command(flatten)]
    answers: AnswerArguments,
}

/// The template of a new spec.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Like {
    /// Six gauges measure the platform's pose; feedback and feed-forward in task space.
    Reference,
    /// Each leg has its own gauge; feed-forward and run-to-run adaptation.
    Legs,
}

/// Answers given on the command line, by option.
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
