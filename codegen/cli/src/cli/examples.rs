//! Examples below the help of each command.
//!
//! Each example is a command line and what it does, after `#` or on the next line. `codegen/cli/tests/examples.rs` runs them
//! unchanged, in a folder with the files that they name; it only parses lines with one of the marks explained in [`MAIN`].

pub const MAIN: &str = "\
Examples:
  specgen platform.toml --no-build         # compile, write Rust source
  specgen platform.toml -o controller  # (minutes)
      compile, build, measure, compare bits
  specgen platform.toml --setup            # (minutes) install tools first
  specgen check platform.toml              # report findings, write nothing
  specgen sim platform.toml --frequency 10
      the controller on a simulated machine
  specgen tune platform.toml --write  # (minutes)
      tune gains on the simulated loop, write them into the spec
  specgen identify record.csv --drive 0:100
  specgen flash platform.toml         # (board) build, check, write to the board

docs/README.md lists the tutorials. Every command has its own examples:
`specgen check --help`. (minutes): takes several minutes. (board):
needs a board, a second program, or an idle computer.

Exit codes: 0 good; 1 spec, record or budget refused, or an unreadable input;
2 usage, or an output that is an input; 3 missing tool, full disk and the like;
4 a simulated run ended before the end of its path; 130 interrupted.";

pub const NEW: &str = "\
Examples:
  specgen new bench --like reference   # no questions: a platform like the paper's
  specgen new mine --like reference --r_B \"200 mm\" --stroke \"100 um\"
  specgen new six --like legs --stroke \"30 um\"
      six legs, each with its own gauge

Without --like it asks; an empty line accepts the value in brackets. The paper's
symbols are also options: --r_B, --r_P, --alpha_B, --alpha_P, --m, --k_a, --T_s.";

pub const LSP: &str = "\
Examples:
  specgen lsp                     # (board) started by an editor

docs/editors.md shows the settings for VS Code, Helix and Neovim.";

pub const CHECK: &str = "\
Examples:
  specgen check platform.toml          # every finding with line, column and fix
  specgen check platform.toml --json
      the same, with margins, reach and precision, for programs";

pub const DESIGN: &str = "\
Examples:
  specgen design platform.toml         # (minutes) needs control.active_damping

The design depends on geometry, masses, stiffness, lags, known modes and
[robust.structure]. After a change of these, run it again.";

pub const EXPLAIN: &str = "\
Examples:
  specgen explain E0441     # a code printed by `specgen check`

docs/diagnostics.md lists all codes.";

pub const BUILD: &str = "\
Examples:
  specgen build legs.toml --target host -o legs-host
      a shared library for this computer
  specgen build platform.toml --target stm32h743 -o controller  # (minutes)
      an image for the NUCLEO-H743ZI2; --assumed-ok permits assumed values
  specgen build platform.toml --target rt-pc -o controller  # (minutes)
      the program of a real-time PC
  specgen build platform.toml --target qemu --no-measure  # (minutes)
      emulated Cortex-M, without instruction counts";

pub const SIZE: &str = "\
Examples:
  specgen size platform.toml        # (minutes) for the spec's target.mcu
  specgen size platform.toml --target stm32h743 --no-measure  # (minutes)
  specgen size controller/target/stm32h743.elf  # (minutes)
      an image that `build` made";

pub const FLASH: &str = "\
Examples:
  specgen flash platform.toml          # (board) build, check, flash
  specgen flash controller/target/stm32h743.elf  # (board)
      an existing image
  specgen flash platform.toml --speed 500 --connect-under-reset  # (board)
      for a long cable, or a part that does not answer";

pub const SIM: &str = "\
Examples:
  specgen sim legs.toml                       # a sweep of the legs, all modes
  specgen sim platform.toml --frequency 10   # rest, a wave, the trajectories
  specgen sim platform.toml --trajectory case-2 --plot case-2.svg
  specgen sim legs.toml --paper -o tables   # the paper's Tables 1 and 2
  specgen sim platform.toml --record run.rec   # for `replay`";

pub const TUNE: &str = "\
Examples:
  specgen tune legs.toml --evaluations 100 -o tuning
      print weights as a patch; write front, history and plot to tuning
  specgen tune platform.toml --write  # (minutes)
      write gains and bandwidths into the spec
  specgen tune platform.toml --what gains --bounds ki=10:1000  # (minutes)
  specgen tune legs.toml --evaluate candidates.json --json
      scores for your own optimiser";

pub const LEARN: &str = "\
Examples:
  specgen learn learning.toml -o case-1.json
      a spec with control.correction = \"2 um\"; case 1 at 10 Hz, 5 passes
  specgen learn learning.toml --from case-1.json --passes 1
      continue from that correction
  specgen learn learning.toml --prepare --passes 0 -o prepared.json
      only the correction that the model predicts
  specgen learn learning.toml --excite response.json
      measure the response of the running loop
  specgen learn learning.toml --response response.json
      learn with that response, independent of the spec's stiffness
  specgen learn learning.toml --socket link --machine stage-7  # (board)
      on a machine, which is armed first and ramped down at the end";

pub const ROBUST: &str = "\
Examples:
  specgen robust legs.toml --draws 10      # ten random machines and the corners
  specgen robust legs.toml --replay gain-low     # one of them, bit for bit
  specgen robust platform.toml --max-error \"60 nm\"  # (minutes)
      as a build gate
  specgen robust legs.toml --draws 9 --shard 1/2 -o part-1.json
      one half of the machines; run the other half on another computer
  specgen robust legs.toml --draws 9 --shard 2/2 -o part-2.json";

pub const MERGE: &str = "\
Examples:
  specgen robust merge part-2.json part-1.json -o merged
      the report of a single run, byte for byte";

pub const REPORT: &str = "\
Examples:
  specgen report legs.toml -o legs.html --no-target   # simulated runs, findings
  specgen report platform.toml   # (minutes) also time, memory, bits
  specgen report platform.toml --paper --no-target  # (minutes) paper's figures";

pub const REPRODUCE: &str = "\
Examples:
  specgen reproduce                    # (minutes) results in reproduction/
  specgen reproduce --generations 1 -o quick  # (minutes)
      with a shortened genetic algorithm";

pub const PIL: &str = "\
Examples:
  specgen pil legs.toml --seconds 0.05  # (minutes)
      an image in QEMU, compared with the host
  specgen pil platform.toml --mode pf-pcc                  # (minutes)
  specgen pil platform.toml --port /dev/ttyACM0  # (board)
      a board instead of QEMU";

pub const PREDICT: &str = "\
Examples:
  specgen identify predict table.csv 10hz.csv
      error of the table on a record that was not used in its fit
  specgen identify predict legs.toml 10hz.csv -o predicted.csv --plot predicted.svg
      the model of leg 0 of the spec, with its creep and dead time

Without displacement_um, the output is relative to negative saturation.";

pub const COMMISSION: &str = "\
Examples:
  specgen commission platform.toml --plan
      what the machine would do, and for how long
  specgen commission platform.toml --socket rt.sock  # (board)
      writes records, results and a new platform.toml to the folder `commission`
  specgen commission commission/platform.toml --socket rt.sock  # (board)
      after the machine was restarted with the new controller: acceptance test
  specgen commission platform.toml --socket rt.sock --again  # (board)
      repeat all steps, or with --step curves that one; later ones are due again
  specgen commission platform.toml --step spec --write  # (board)
      write the results into platform.toml itself
  specgen commission platform.toml --socket rt.sock --check  # (board)
      a machine in use: gains, delays, modes and noise against those kept

The legs move one at a time over their whole stroke. The command asks first;
without a terminal it needs --yes. However it ends, the machine is ramped down.";

pub const OPERATE: &str = "\
Examples:
  specgen operate --port /dev/ttyACM0 platform.toml status  # (board)
      phase, cause, late ticks
  specgen operate --port /dev/ttyACM0 platform.toml  # (board)
      interactive
  specgen operate --port /dev/ttyACM0 arm \"wait arming\" run  # (board)
  specgen operate --socket rt.sock platform.toml --script run.txt  # (board)
      a real-time PC, with commands from a file

Commands: status, arm, run, hold, ramp-down, acknowledge, none,
  set NAME=VALUE…, move|jog AXIS=QUANTITY… (z=1um rx=2urad), where, limits,
  can-i-go AXIS=QUANTITY… [speed=QUANTITY], mark|goto NAME,
  play TRAJECTORY [correction=FILE machine=NAME],
  frame [none | work|tool AXIS=QUANTITY…], mode p|f|pf, gains [NAME=VALUE…],
  trigger LINE NAME=VALUE…, wait PHASE|arrived|SECONDS [TIMEOUT], config,
  config [code_min=CODE] [code_max=CODE], config write SPEC,
  record arm [AFTER] | trigger | stop | look | download FILE, wave FILE | stop,
  on-edge [drop | move … | jog … | goto … | play … | wave FILE],
  watch [EVERY [SECONDS [FILE]]], shutdown (ramps down, ends the program
  at a socket)
docs/operate.md explains them. `none` ends a request, so that it can be given
again; `acknowledge` clears a fault; `can-i-go` names the limit that prevents it.

The link ends with this command; the machine then holds after 0.1 s. Ctrl-C
ramps down first.";

pub const PANEL: &str = "\
Examples:
  specgen panel platform.toml --socket rt.sock         # (board) at 127.0.0.1:8020
  specgen panel platform.toml --port /dev/ttyACM0      # (board)
  specgen panel platform.toml --socket rt.sock --listen 0.0.0.0:8020  # (board)
      also for others on the network who know the token

The printed address contains the token. Anyone with the token can watch and take
control. One page is in control at a time; hold and ramp down work from every
page. If the page in control closes, the machine treats the host as lost: it
holds, then ramps down. Ctrl-C ramps down first. See docs/panel.md.";

pub const GCS: &str = "\
Examples:
  specgen gcs --socket rt.sock                       # (board) at 127.0.0.1:50000
  specgen gcs --port /dev/ttyACM0 platform.toml      # (board) check the spec
  specgen gcs --socket rt.sock --axis 1=Z            # (board)
      for a client with a single axis named 1

Axes X Y Z in um, U V W in urad. docs/gcs.md lists the commands. This program is
the machine's host: Ctrl-C ramps down first.";

pub const REPLAY: &str = "\
Examples:
  specgen replay run.rec --spec platform.toml
      bit-equal, or the first tick that differs
  specgen replay run.rec --spec platform.toml --emitted  # (minutes)
      the same with the emitted controller, which is built first
  specgen replay run.rec --csv run.csv  # time, inputs and outputs, with units
  specgen replay run.rec --spec platform.toml --mcap run.mcap
      for log viewers";

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
      drive in column 2, time from the sampling rate in Hz
  specgen identify run.rec --spec platform.toml -o legs
      names legs that changed since identification; writes six tables to legs/
  specgen identify linear 1hz.csv 10hz.csv       # one frequency per record";

pub const LINEAR: &str = "\
Examples:
  specgen identify linear 1hz.csv 10hz.csv
      gain, λ, and the weights that are stable over λ
  specgen identify linear 1hz.csv 10hz.csv --frequency 1,10 --spec platform.toml";

pub const RESPONSE: &str = "\
Examples:
  specgen identify response sweep.csv --plot response.svg
      resonance, damping, lag, dead time

For the response of a running closed loop: specgen learn SPEC --excite FILE.";

pub const GAUGE: &str = "\
Examples:
  specgen identify gauge gauge.csv      # a polynomial for [sensor] or [[gauge]]";

pub const STIFFNESS: &str = "\
Examples:
  specgen identify stiffness force.csv                # actuator.axial_stiffness";

pub const EXPORT: &str = "\
Examples:
  specgen export c platform.toml -o c      # prints the compile command";

pub const EXPORT_PYTHON: &str = "\
Examples:
  specgen export python platform.toml -o python   # controller.py and its library";

pub const EXPORT_TABLE: &str = "\
Examples:
  specgen export table record.csv -o record.mat
  specgen export table record.csv -o record.npz

Every command that writes a table writes these forms, by the suffix.";

pub const EXPORT_FMU: &str = "\
Examples:
  specgen export fmu platform.toml -o fmu   # for Simulink, Dymola, OMSimulator
  specgen export fmu platform.toml -o fmu --plant   # and the machine";

pub const GAINS: &str = "\
Examples:
  specgen identify gains run.rec --spec platform.toml -o gains
      writes six tables to gains/, prints the line of the spec to use them";

pub const CROSS_TALK: &str = "\
Examples:
  specgen identify cross-talk leg0.csv leg1.csv leg2.csv leg3.csv leg4.csv leg5.csv
      prints actuator.cross_talk; each file is of `watch` while one leg is driven";

pub const RATE: &str = "\
Examples:
  specgen identify rate record.csv fast.csv --drive 0:100 --grid 16 -o leg
      writes the lines for [hysteresis] to leg.toml";

pub const FORC: &str = "\
Examples:
  specgen forc -o record.csv            # the reference leg, 32 curves at 20 V/s
  specgen forc platform.toml -o another.csv   # a leg of this spec
  specgen forc -o fast.csv --rate 2000 --grid 16
      a second rate, for `identify rate`
  specgen forc -o leg.csv --two-rates --grid 8
      and leg-fast.csv, leg-arbitrary.csv, for `identify --model auto`
  specgen forc --drive-only --drive -90:90 --sampling 1000 -o drive.csv
      the drive signal for a waveform generator";

pub const PLANT: &str = "\
Examples:
  specgen plant platform.toml  # (board)
      until Ctrl-C; connect with rt-pc --sim plant
  specgen plant platform.toml --name bench --cpu 1 &  # (board)
      on a processor that the controller does not use";

pub const DOCTOR: &str = "\
Examples:
  specgen doctor --seconds 0.5           # wake-ups every 100 us, what to change
  specgen doctor platform.toml --cpu 1  # (board)
      exit code 1 if the computer does not keep the spec's period";

pub const DUMP_IR: &str = "\
Examples:
  specgen dump-ir platform.toml > constants.json
      every constant of the controller";

pub const CACHE: &str = "\
Examples:
  specgen cache                         # folder, number of builds, size

--clear empties the cache, which is safe at any time. SPECGEN_CACHE=DIR selects
another folder, an empty SPECGEN_CACHE switches the cache off, and --no-cache
does so for one command.";

pub const COMPLETIONS: &str = "\
Examples:
  specgen completions bash > specgen.bash
      for one session: source specgen.bash

To install, write the script to the file that your shell reads:
  bash        ~/.local/share/bash-completion/completions/specgen
  zsh         ~/.zfunc/_specgen, and in ~/.zshrc:
              fpath+=~/.zfunc; autoload -U compinit; compinit
  fish        ~/.config/fish/completions/specgen.fish
  PowerShell  append it to $PROFILE";
