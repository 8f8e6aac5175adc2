//! Examples below the help of each command.
//!
//! Each line is a command as typed and, behind `#` or in a line below, what it does. No line is longer than 80 letters. `codegen/cli/tests/examples.rs` runs them as they stand here, in a
//! folder that has the files they name; lines with one of the marks that [`MAIN`] explains are only parsed.

pub const MAIN: &str = "\
Examples:
  specgen platform.toml --no-build         # compile, write Rust source
  specgen platform.toml -o controller  # (minutes)
      built, measured, bits compared
  specgen platform.toml --setup            # (minutes) brings the tools first
  specgen check platform.toml              # every finding, nothing written
  specgen sim platform.toml --frequency 10
      the emitted controller on its machine
  specgen tune platform.toml --write  # (minutes)
      gains from the simulated loop, into the spec
  specgen identify record.csv --drive 0:100
  specgen flash platform.toml         # (board) build, check, write to the board

docs/guide.md leads from the bench to running firmware. Every command has
examples of its own: `specgen check --help`. (minutes) takes several minutes;
(board) needs a board, a second program, or an idle computer.

Exit codes: 0 good; 1 spec, record or budget refused, or an input that cannot be
read; 2 usage, or an output that is an input; 3 environment; 4 a simulated run
ended before the end of its path; 130 interrupted.";

pub const NEW: &str = "\
Examples:
  specgen new bench --like reference   # asks nothing: a platform as the paper's
  specgen new mine --like reference --r_B \"200 mm\" --stroke \"100 um\"
  specgen new six --like legs --stroke \"30 um\"
      six legs with gauges of their own

Without --like it asks; an empty line takes the value in brackets. The paper's
symbols are options, too: --r_B, --r_P, --alpha_B, --alpha_P, --m, --k_a, --T_s.";

pub const LSP: &str = "\
Examples:
  specgen lsp                     # (board) an editor starts it, and talks to it

docs/editors.md has the lines for VS Code, Helix and Neovim.";

pub const CHECK: &str = "\
Examples:
  specgen check platform.toml          # every finding with line, column and fix
  specgen check platform.toml --json
      the same, with margins, reach and precision, for programs";

pub const EXPLAIN: &str = "\
Examples:
  specgen explain E0441                    # a code that `specgen check` printed: why it matters, an example, the fix

docs/diagnostics.md has the pages of all codes.";

pub const BUILD: &str = "\
Examples:
  specgen build legs.toml --target host -o legs-host
      a shared library for this computer
  specgen build platform.toml --target stm32h743 -o controller  # (minutes)
      an image of the NUCLEO-H743ZI2; with --assumed-ok while values of the spec are assumed
  specgen build platform.toml --target rt-pc -o controller  # (minutes)
      the program of a real-time PC
  specgen build platform.toml --target qemu --no-measure  # (minutes)
      emulated Cortex-M, nothing counted";

pub const SIZE: &str = "\
Examples:
  specgen size platform.toml        # (minutes) builds for the spec's target.mcu
  specgen size platform.toml --target stm32h743 --no-measure  # (minutes)
  specgen size controller/target/stm32h743.elf  # (minutes)
      what `build` left there";

pub const FLASH: &str = "\
Examples:
  specgen flash platform.toml          # (board) build, check, write by probe-rs
  specgen flash controller/target/stm32h743.elf  # (board)
      an image that is there
  specgen flash platform.toml --speed 500 --connect-under-reset  # (board)
      a long cable, a part that does not answer";

pub const SIM: &str = "\
Examples:
  specgen sim legs.toml                       # a sweep of its legs, every law
  specgen sim platform.toml --frequency 10   # at rest, a wave, its trajectories
  specgen sim platform.toml --trajectory case-2 --plot case-2.svg
  specgen sim legs.toml --paper -o tables   # Tables 1 and 2, beside the paper's
  specgen sim platform.toml --record run.rec   # for `replay`";

pub const TUNE: &str = "\
Examples:
  specgen tune legs.toml --evaluations 100 -o tuning
      weights as a patch; front, history and plot in tuning
  specgen tune platform.toml --write  # (minutes)
      gains and bandwidths into the spec
  specgen tune platform.toml --what gains --bounds ki=10:1000  # (minutes)
  specgen tune legs.toml --evaluate candidates.json --json
      scores for a search of your own";

pub const LEARN: &str = "\
Examples:
  specgen learn learning.toml -o case-1.json
      its [control] has correction = \"2 um\"; case 1 at 10 Hz, 5 passes
  specgen learn learning.toml --from case-1.json --passes 1
      continues from that correction
  specgen learn learning.toml --prepare --passes 0 -o prepared.json
      the correction that the model predicts, without a pass
  specgen learn learning.toml --excite response.json
      measures the response of the running loop
  specgen learn learning.toml --response response.json
      learns with that response, so the stiffness of the spec does not matter
  specgen learn learning.toml --trajectory case-1 --socket link --machine stage-7  # (board)
      on a machine: armed first, ramped down afterwards";

pub const ROBUST: &str = "\
Examples:
  specgen robust legs.toml --draws 10      # ten random machines and the corners
  specgen robust legs.toml --replay gain-low     # one of them alone, to the bit
  specgen robust platform.toml --max-error \"60 nm\"  # (minutes)
      a gate for builds
  specgen robust legs.toml --draws 9 --shard 1/2 -o part-1.json
      half of the machines; the other half on another computer
  specgen robust legs.toml --draws 9 --shard 2/2 -o part-2.json";

pub const MERGE: &str = "\
Examples:
  specgen robust merge part-2.json part-1.json -o merged
      the report of a single run, byte for byte";

pub const REPORT: &str = "\
Examples:
  specgen report legs.toml -o legs.html --no-target   # simulated runs, findings
  specgen report platform.toml   # (minutes) with time, memory, bits
  specgen report platform.toml --paper --no-target  # (minutes) 2nd page";

pub const REPRODUCE: &str = "\
Examples:
  specgen reproduce                    # (minutes) everything, into reproduction
  specgen reproduce --generations 1 -o quick  # (minutes)
      with hardly any genetic algorithm";

pub const PIL: &str = "\
Examples:
  specgen pil legs.toml --seconds 0.05  # (minutes)
      the image in QEMU against the host
  specgen pil platform.toml --mode pf-pcc                  # (minutes)
  specgen pil platform.toml --port /dev/ttyACM0  # (board)
      a board instead of QEMU";

pub const PREDICT: &str = "\
Examples:
  specgen identify predict table.csv 10hz.csv
      how far off the table is on a record it was not fitted to
  specgen identify predict legs.toml 10hz.csv -o predicted.csv --plot predicted.svg
      the model of leg 0 of the spec, with its creep and dead time

A drive without displacement_um is predicted above negative saturation.";

pub const OPERATE: &str = "\
Examples:
  specgen operate --port /dev/ttyACM0 platform.toml status  # (board)
      phase, cause, late ticks
  specgen operate --port /dev/ttyACM0 platform.toml  # (board)
      line by line from the keyboard
  specgen operate --port /dev/ttyACM0 arm \"wait arming\" run  # (board)
  specgen operate --socket rt.sock platform.toml --script run.txt  # (board)
      a real-time PC, from a file

Commands: status, arm, run, hold, ramp-down, acknowledge, none,
  set NAME=VALUE…, move|jog AXIS=QUANTITY… (z=1um rx=2urad), where, limits,
  can-i-go AXIS=QUANTITY… [speed=QUANTITY], mark|goto NAME,
  play TRAJECTORY [correction=FILE machine=NAME],
  frame [none | work|tool AXIS=QUANTITY…], mode p|f|pf, gains [NAME=VALUE…],
  wait PHASE|arrived|SECONDS [TIMEOUT], config, config write SPEC,
  record arm [AFTER] | trigger | stop | look | download FILE, wave FILE | stop,
  on-edge [drop | move … | jog … | goto … | play … | wave FILE],
  watch [EVERY [SECONDS [FILE]]], stop (ends the program at a socket)

The link lives as long as this command does; without it the machine holds after
0.1 s. Ctrl-C ramps down first.";

pub const PANEL: &str = "\
Examples:
  specgen panel platform.toml --socket rt.sock         # (board) at 127.0.0.1:8020
  specgen panel platform.toml --port /dev/ttyACM0      # (board)
  specgen panel platform.toml --socket rt.sock --listen 0.0.0.0:8020  # (board)
      for others on the network who know the token

The printed address contains the token: whoever has it can watch and take control.
One page is in control at a time; hold and ramp down work from every page. If the
page in control closes, the machine treats the host as lost: it holds, then ramps
down. Ctrl-C ramps down first. See docs/panel.md.";

pub const GCS: &str = "\
Examples:
  specgen gcs --socket rt.sock                       # (board) at 127.0.0.1:50000
  specgen gcs --port /dev/ttyACM0 platform.toml      # (board) only its controller
  specgen gcs --socket rt.sock --axis 1=Z            # (board)
      for a client that knows one axis, called 1

Axes X Y Z in um, U V W in urad. docs/gcs.md has the commands. The machine has
this program as its host: Ctrl-C ramps down first.";

pub const REPLAY: &str = "\
Examples:
  specgen replay run.rec --spec platform.toml
      bit-equal, or the first tick that differs
  specgen replay run.rec --spec platform.toml --emitted  # (minutes)
      the same on the emitted controller, which is built
  specgen replay run.rec --csv run.csv  # time, inputs with units, what came out
  specgen replay run.rec --spec platform.toml --mcap run.mcap
      for viewers of logs";

pub const DYNAMICS: &str = "\
Examples:
  specgen dynamics platform.toml --states states.json
      M, C, G, J and leg forces, as JSON
  specgen dynamics platform.toml --states states.json -o forces.json
      into a file";

pub const IDENTIFY: &str = "\
Examples:
  specgen identify record.csv --drive 0:100
      grid by cross-validation; fit, noise, drift
  specgen identify record.csv --drive 0:100 --grid 16 --plot table.svg
  specgen identify record.csv --drive 0:100 --grid 16 -o table.csv
  specgen identify record.csv --drive 0:100 --columns drive_V=2 --rate 51.2
      the drive by its column, times counted
  specgen identify linear 1hz.csv 10hz.csv       # records of one frequency each";

pub const LINEAR: &str = "\
Examples:
  specgen identify linear 1hz.csv 10hz.csv
      gain, λ, and the weights that are stable over it
  specgen identify linear 1hz.csv 10hz.csv --frequency 1,10 --spec platform.toml";

pub const RESPONSE: &str = "\
Examples:
  specgen identify response sweep.csv --plot response.svg
      resonance, damping, lag, dead time

The response of a platform whose loop runs: specgen learn SPEC --excite FILE.";

pub const GAUGE: &str = "\
Examples:
  specgen identify gauge gauge.csv      # a polynomial for [sensor] or [[gauge]]";

pub const STIFFNESS: &str = "\
Examples:
  specgen identify stiffness force.csv                # actuator.axial_stiffness";

pub const EXPORT: &str = "\
Examples:
  specgen export c platform.toml -o c      # prints the line that compiles it";

pub const EXPORT_PYTHON: &str = "\
Examples:
  specgen export python platform.toml -o python   # controller.py and its library";

pub const EXPORT_FMU: &str = "\
Examples:
  specgen export fmu platform.toml -o fmu   # for Simulink, Dymola, OMSimulator
  specgen export fmu platform.toml -o fmu --plant   # and the machine";

pub const GAINS: &str = "\
Examples:
  specgen identify gains run.rec --spec platform.toml -o gains
      six tables in gains/, and the line of the spec that names them";

pub const RATE: &str = "\
Examples:
  specgen identify rate record.csv fast.csv --drive 0:100 --grid 16 -o leg
      leg.toml has the lines for [hysteresis]";

pub const FORC: &str = "\
Examples:
  specgen forc -o record.csv            # the reference leg, 32 curves at 20 V/s
  specgen forc platform.toml -o another.csv   # a leg of this spec
  specgen forc -o fast.csv --rate 2000 --grid 16
      a second rate, for `identify rate`
  specgen forc --drive-only --drive -90:90 --sampling 1000 -o drive.csv
      what a generator plays on the bench";

pub const PLANT: &str = "\
Examples:
  specgen plant platform.toml  # (board)
      until Ctrl-C; rt-pc --sim plant joins in
  specgen plant platform.toml --name bench --cpu 1 &  # (board)
      beside the controller's processor";

pub const DOCTOR: &str = "\
Examples:
  specgen doctor --seconds 0.5           # wake-ups every 100 us, what to change
  specgen doctor platform.toml --cpu 1  # (board)
      exit code 1 if the spec's period is not kept";

pub const DUMP_IR: &str = "\
Examples:
  specgen dump-ir platform.toml > constants.json
      every constant of the controller";

pub const CACHE: &str = "\
Examples:
  specgen cache                         # its folder, how many builds, how large

With --clear it is emptied, which is safe at any time. SPECGEN_CACHE=DIR names
another folder, SPECGEN_CACHE= keeps nothing; --no-cache does neither take nor
keep for one command.";

pub const COMPLETIONS: &str = "\
Examples:
  specgen completions bash > specgen.bash
      for one session: source specgen.bash

Install, once, into the file that your shell reads:
  bash        ~/.local/share/bash-completion/completions/specgen
  zsh         ~/.zfunc/_specgen, and in ~/.zshrc:
              fpath+=~/.zfunc; autoload -U compinit; compinit
  fish        ~/.config/fish/completions/specgen.fish
  PowerShell  behind what $PROFILE has";
