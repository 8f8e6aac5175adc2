//! The command line.

use std::path::PathBuf;

use lexopt::prelude::*;
use specgen_rt::clock::SECOND;

/// Units of times, ns.
const S: f64 = SECOND as f64;
const MS: f64 = S / 1e3;

pub const HELP: &str = "\
Runs the controller in real time on this PC.

Usage: rt-pc [OPTIONS]

Machine
  --sim NAME           the machine that `specgen plant SPEC --name NAME`
                       simulates (default: NAME is `plant`)
  --comedi DEVICE      a data acquisition card such as /dev/comedi0; needs a
                       build with `--features comedi`
  --comedi-out DEVICE  a card of the amplifiers, once for each in order
                       (default: that of the gauges)
  --comedi-range LOW:HIGH
                       voltages that a gauge's input range must contain
                       (default -10:10)
  --comedi-out-range LOW:HIGH
                       voltages that an amplifier's output range must contain
                       (default -10:10)
  --assumed-ok         with --comedi: accept assumed values of the spec and
                       simulated records
  --comedi-library FILE
                       another libcomedi than the system's
  --sim-timeout MS     time limit of a reading of the simulated machine
                       (default 20)
  --sim-edge-every S   the input line of the simulated machine rises every S
                       seconds (default: never)

Time
  --seconds S          ramp down and end after S seconds (default: at a signal)
  --late-after SHARE   outputs later than this share of the period count as late
                       (default 0.5)
  --priority P         SCHED_FIFO priority, 1 to 99 (default 80)
  --elastic            with --sim: a late tick moves the next ones, none is
                       skipped, for PCs that cannot keep the period
  --cpu N              keep the loop on processor N (default: not pinned)
  --allow-no-rt        run without real-time privileges; the missing ones are
                       reported

Operation
  --arm                arm and run at once; else wait for a host over the link
  --set NAME=VALUE     once running, set an input word, such as command=3 or
                       setpoint[2]=1e-6; implies --arm
  --config NAME=VALUE  a setting for this run, such as mode=6
  --link PATH          answer the link protocol of boards, for
                       `specgen operate --socket PATH`
  --link-silence MS    a host in control is lost after this silence
                       (default: host_lost of the spec)
  --link-idle S        a host without a command for this time loses control to
                       the next host with one (default 60)
  --record FILE        write every tick of the run to FILE, for `specgen replay`
  --capture FILE       write the recording around a fault, or a trigger over
                       the link, to FILE
  --json               print the summary as JSON
  --help, --version

SIGINT or SIGTERM ramps down and ends; a second one ends at once with the
amplifiers off.
Exit codes: 0 good, 1 the machine faulted or held for a cause, a record is
incomplete, the account does not balance or a card would be driven with assumed
values, 2 usage, 3 environment.
";

/// The hardware of the controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Hardware {
    Simulated(String),
    /// A card, by device file.
    Comedi(PathBuf),
}

#[derive(Debug, Clone)]
#[cfg_attr(not(feature = "comedi"), allow(dead_code))] // The settings of cards.
pub struct Options {
    pub hardware: Hardware,
    pub comedi_outputs: Vec<PathBuf>,
    /// Of inputs and of outputs, V.
    pub comedi_ranges: [[f64; 2]; 2],
    pub comedi_library: Option<PathBuf>,
    /// Accept assumed values: a controller with assumed values may drive a card.
    pub assumed_ok: bool,
    /// ns.
    pub sim_timeout: u64,
    /// ns.
    pub sim_edge_every: Option<u64>,
    /// ns.
    pub duration: Option<u64>,
    /// Share of the period.
    pub late_after: f64,
    /// A late tick delays the next ones.
    pub elastic: bool,
    /// 1 to 99.
    pub priority: u8,
    pub cpu: Option<usize>,
    pub allow_no_rt: bool,
    pub arm: bool,
    pub set: Vec<String>,
    pub config: Vec<String>,
    pub link: Option<PathBuf>,
    /// ns.
    pub link_silence: Option<u64>,
    /// Longest time without a command for a host in control, ns.
    pub link_idle: u64,
    /// File of the record.
    pub record: Option<PathBuf>,
    /// File of the recorder.
    pub capture: Option<PathBuf>,
    pub json: bool,
}

/// Result of the command line.
#[derive(Debug)]
pub enum Invocation {
    Run(Box<Options>),
    Text(String),
}

/// Reads arguments, the program's name first.
///
/// # Errors
/// In words.
pub fn parse(arguments: impl IntoIterator<Item = std::ffi::OsString>) -> Result<Invocation, String> {
    read(arguments).map_err(|error| format!("{error}; see rt-pc --help"))
}

fn read(arguments: impl IntoIterator<Item = std::ffi::OsString>) -> Result<Invocation, lexopt::Error> {
    let mut options = Options {
        hardware: Hardware::Simulated("plant".to_owned()),
        comedi_outputs: Vec::new(),
        comedi_ranges: [[-10.0, 10.0]; 2],
        comedi_library: None,
        assumed_ok: false,
        sim_timeout: 20_000_000,
        sim_edge_every: None,
        duration: None,
        late_after: 0.5,
        elastic: false,
        priority: 80,
        cpu: None,
        allow_no_rt: false,
        arm: false,
        set: Vec::new(),
        config: Vec::new(),
        link: None,
        link_silence: None,
        link_idle: 60_000_000_000,
        record: None,
        capture: None,
        json: false,
    };
    let mut parser = lexopt::Parser::from_iter(arguments);
    while let Some(argument) = parser.next()? {
        match argument {
            Long("help") | Short('h') => return Ok(Invocation::Text(HELP.to_owned())),
            Long("version") => {
                let [name, digest] = [controller::SPEC_NAME, controller::SPEC_DIGEST];
                let version = controller::SPECGEN_VERSION;
                return Ok(Invocation::Text(format!("rt-pc {version}, controller of `{name}`, digest {digest}\n")));
            }
            Long("sim") => options.hardware = Hardware::Simulated(parser.value()?.string()?),
            Long("comedi") => options.hardware = Hardware::Comedi(parser.value()?.into()),
            Long("comedi-out") => options.comedi_outputs.push(parser.value()?.into()),
            Long("comedi-range") => options.comedi_ranges[0] = range(&mut parser, "--comedi-range")?,
            Long("comedi-out-range") => options.comedi_ranges[1] = range(&mut parser, "--comedi-out-range")?,
            Long("comedi-library") => options.comedi_library = Some(parser.value()?.into()),
            Long("assumed-ok") => options.assumed_ok = true,
            Long("sim-timeout") => options.sim_timeout = ns(&mut parser, "--sim-timeout", 0.1, 10_000.0, MS)?,
            Long("sim-edge-every") => options.sim_edge_every = Some(ns(&mut parser, "--sim-edge-every", 0.01, 1e4, S)?),
            Long("seconds") => options.duration = Some(ns(&mut parser, "--seconds", 0.01, 1e7, S)?),
            Long("late-after") => options.late_after = number(&mut parser, "--late-after", 0.01, 1.0)?,
            Long("priority") => options.priority = number(&mut parser, "--priority", 1.0, 99.0)? as u8,
            Long("elastic") => options.elastic = true,
            Long("cpu") => options.cpu = Some(parser.value()?.parse()?),
            Long("allow-no-rt") => options.allow_no_rt = true,
            Long("arm") => options.arm = true,
            Long("set") => {
                options.arm = true;
                options.set.push(parser.value()?.string()?);
            }
            Long("config") => options.config.push(parser.value()?.string()?),
            Long("link") => options.link = Some(parser.value()?.into()),
            Long("link-idle") => options.link_idle = ns(&mut parser, "--link-idle", 0.1, 86_400.0, S)?,
            Long("link-silence") => options.link_silence = Some(ns(&mut parser, "--link-silence", 1.0, 6e4, MS)?),
            Long("capture") => options.capture = Some(parser.value()?.into()),
            Long("record") => options.record = Some(parser.value()?.into()),
            Long("json") => options.json = true,
            _ => return Err(argument.unexpected()),
        }
    }
    if options.elastic && !matches!(options.hardware, Hardware::Simulated(_)) {
        return Err("--elastic is for a simulated machine: a real one does not wait".into());
    }
    Ok(Invocation::Run(Box::new(options)))
}

fn number(parser: &mut lexopt::Parser, name: &str, low: f64, high: f64) -> Result<f64, lexopt::Error> {
    let text = parser.value()?.string()?;
    let fits = |value: &f64| (low..=high).contains(value);
    text.parse()
        .ok()
        .filter(fits)
        .ok_or_else(|| format!("{name}: expected a number from {low} to {high}, found `{text}`").into())
}

/// A time in `unit` (ns) from `low` to `high`; ns.
fn ns(parser: &mut lexopt::Parser, name: &str, low: f64, high: f64, unit: f64) -> Result<u64, lexopt::Error> {
    Ok((number(parser, name, low, high)? * unit) as u64)
}

/// Two voltages, the lower one first.
fn range(parser: &mut lexopt::Parser, name: &str) -> Result<[f64; 2], lexopt::Error> {
    let text = parser.value()?.string()?;
    let volts = text.split_once(':').and_then(|(low, high)| Some([low.parse().ok()?, high.parse().ok()?]));
    let fits = |volts: &[f64; 2]| volts[0] < volts[1] && volts.iter().all(|volt| volt.abs() <= 100.0);
    volts.filter(fits).ok_or_else(|| format!("{name}: expected two voltages such as -10:10, found `{text}`").into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::{options as run, parsed};

    #[test]
    fn options_are_read_and_nonsense_is_refused() {
        let Ok(Invocation::Run(options)) = parsed("--sim a --seconds 2.5 --set command=3 --cpu 1 --record x") else {
            unreachable!("a good line")
        };
        assert_eq!((options.hardware, options.duration), (Hardware::Simulated("a".to_owned()), Some(2_500_000_000)));
        assert!(options.arm && options.cpu == Some(1) && !options.allow_no_rt);
        for (line, expected) in [
            ("--seconds", "missing argument"),
            ("--seconds nan", "from 0.01 to 10000000, found `nan`"),
            ("--priority 0", "from 1 to 99, found `0`"),
            ("--link-silence 0", "from 1 to 60000, found `0`"),
            ("--late-after 2", "from 0.01 to 1, found `2`"),
            ("--comedi-range 10:-10", "two voltages such as -10:10, found `10:-10`"),
            ("--cpu x", "cannot parse"),
            ("--elastic --comedi /dev/comedi0", "a real one does not wait"),
            ("now", "unexpected argument"),
            ("--fast", "--fast"),
        ] {
            let error = parsed(line).map(|_| ()).unwrap_err();
            assert!(error.contains(expected) && error.ends_with("see rt-pc --help"), "{line}: {error}");
        }
        assert!(matches!(parsed("--help"), Ok(Invocation::Text(text)) if text == HELP));
        let wide: Vec<&str> = HELP.lines().filter(|line| line.chars().count() > 80).collect();
        assert!(wide.is_empty(), "{wide:#?}");
    }

    #[test]
    fn without_options_a_simulated_machine_waits_for_a_signal() {
        let Options {
            hardware,
            comedi_outputs,
            comedi_ranges,
            comedi_library,
            assumed_ok,
            sim_timeout,
            sim_edge_every,
            duration,
            late_after,
            elastic,
            priority,
            cpu,
            allow_no_rt,
            arm,
            set,
            config,
            link,
            link_silence,
            link_idle,
            record,
            capture,
            json,
        } = run("");
        assert_eq!(hardware, Hardware::Simulated("plant".to_owned()));
        assert!(comedi_outputs.is_empty() && comedi_library.is_none() && !assumed_ok);
        assert_eq!(comedi_ranges, [[-10.0, 10.0]; 2]);
        assert_eq!((sim_timeout, sim_edge_every, duration), (20_000_000, None, None));
        assert_eq!((late_after, elastic, priority, cpu, allow_no_rt), (0.5, false, 80, None, false));
        assert!(!arm && set.is_empty() && config.is_empty() && !json);
        assert_eq!((link, link_silence, link_idle, record, capture), (None, None, 60_000_000_000, None, None));
    }

    #[test]
    fn every_option_says_what_its_name_says() {
        let options = run(
            "--comedi /dev/a --comedi-out b --comedi-out c --comedi-range -1:2 --comedi-out-range 0:100 --comedi-library l --assumed-ok",
        );
        assert_eq!(options.hardware, Hardware::Comedi("/dev/a".into()));
        assert_eq!(options.comedi_outputs, [PathBuf::from("b"), PathBuf::from("c")]);
        assert_eq!(options.comedi_ranges, [[-1.0, 2.0], [0.0, 100.0]]);
        assert!(options.assumed_ok && options.comedi_library == Some("l".into()));
        let options = run(
            "--sim-timeout 1.5 --sim-edge-every 0.25 --seconds 3 --late-after 0.75 --priority 7 --elastic --cpu 2 --allow-no-rt",
        );
        assert_eq!((options.sim_timeout, options.sim_edge_every), (1_500_000, Some(250_000_000)));
        assert_eq!((options.duration, options.late_after), (Some(3_000_000_000), 0.75));
        assert!(options.elastic && options.allow_no_rt && !options.arm);
        assert_eq!((options.priority, options.cpu), (7, Some(2)));
        let options = run(
            "--arm --config mode=6 --config kp[0]=1 --link p --link-silence 1.5 --link-idle 2 --record r --capture c --json",
        );
        assert!(options.arm && options.json && options.set.is_empty());
        assert_eq!(options.config, ["mode=6", "kp[0]=1"]);
        assert_eq!((options.link_silence, options.link_idle), (Some(1_500_000), 2_000_000_000));
        let paths = [options.link, options.record, options.capture];
        assert_eq!(paths, ["p", "r", "c"].map(|path| Some(path.into())));
        let options = run("--set command=3 --set setpoint[0]=1");
        assert!(options.arm && options.set == ["command=3", "setpoint[0]=1"]);
        let Ok(Invocation::Text(version)) = parsed("--version") else { panic!("no version") };
        assert!(version.contains(controller::SPEC_DIGEST) && version.starts_with("rt-pc "));
        for (range, good) in [("1:1", false), ("-100:100", true), ("-101:100", false), ("0:101", false), ("1", false)] {
            assert_eq!(parsed(&format!("--comedi-range {range}")).is_ok(), good, "{range}");
        }
    }
}
