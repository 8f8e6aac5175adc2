//! What goes wrong while a platform runs: gauges, streams, commands, forces, settings. The emitted controller drives the
//! simulated machine through its words; every tick of every run is held to what a voltage may be, see [`guarded`].

mod guarded;

use guarded::*;
use host_sim::platform::WorkPart;
use host_sim::platform::rig::{Command, GaugeFault, Request};
use host_sim::trajectory::PoseTarget;
use specgen_tests::{length, worse};

#[test]
fn a_gauge_that_fails_holds_the_pose_and_its_return_makes_no_jump() {
    let faults = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1.0, -55.01e-6, 1e300, f64::MAX];
    for (gauge, reading) in (0..6).cycle().zip(faults) {
        run(|run| {
            let (error, step, last) = undisturbed(run);
            run.fault(gauge, Some(GaugeFault::Reading(reading)));
            // A quarter of a lap and more: the path moves on by most of its way.
            let bad = run.stream(LAP / 3);
            run.fault(gauge, None);
            let after = run.stream(2 * LAP);
            assert_eq!(all_status(&bad), [1 << (8 + gauge)], "gauge {gauge}: {reading}");
            assert_eq!(all_status(&after), [0], "gauge {gauge}: {reading}");
            for tick in &bad {
                assert_eq!(tick.measured, last.measured, "the last pose believed is held, to the bit");
            }
            let settled = worst(&after[LAP..]);
            let (failing, returned, settled_nm) = (worst(&bad) * 1e9, worst(&after) * 1e9, settled * 1e9);
            let (before, step_failing) = (error * 1e9, largest_step(&last, &bad) * 1e3);
            let (step_after, step_before) = (largest_step(&bad[bad.len() - 1], &after) * 1e3, step * 1e3);
            println!(
                "gauge {gauge} at {reading:e}: {failing:.0} nm while it fails, {returned:.0} nm on its return, {settled_nm:.1} nm settled ({before:.1} before); voltage steps {step_failing:.1} and {step_after:.1} mV ({step_before:.1} before)"
            );
            // As far off as the inverse model alone leaves it, and back within a lap; no step of the voltages beyond what
            // catching up takes.
            assert!(worst(&bad) < 1e-6 && worst(&after) < 1e-6 && settled < 1.2 * error);
            assert!(largest_step(&last, &bad) < 2.0 * step && largest_step(&bad[bad.len() - 1], &after) < 0.3);
        });
    }
}

#[test]
fn a_gauge_stuck_within_its_range_stays_within_limits_and_is_recovered_from() {
    for gauge in 0..6 {
        run(|run| {
            let (error, ..) = undisturbed(run);
            run.fault(gauge, Some(GaugeFault::Stuck));
            let stuck = run.stream(LAP / 3);
            run.fault(gauge, None);
            let after = run.stream(2 * LAP);
            let (at_once, later) = (worst(&stuck) * 1e9, worst(&after[500..]) * 1e9);
            let (settled, before, status) = (worst(&after[LAP..]) * 1e9, error * 1e9, all_status(&stuck));
            let status_after = all_status(&after);
            println!(
                "gauge {gauge} stuck: {at_once:.0} nm, {later:.0} nm after 50 ms, {settled:.1} nm settled ({before:.1} before), status {status:x?} {status_after:x?}"
            );
            let limited = all_status(&stuck).iter().all(|status| status & !0x3f == 0);
            assert!(limited, "it cannot be distinguished from a gauge that works");
            assert_eq!(all_status(&after[LAP / 4..]), [0]);
            assert!(worst(&after[LAP / 4..]) < 1e-6 && worst(&after[LAP..]) < 1.3 * error);
        });
    }
}

#[test]
fn a_stream_that_dries_up_is_brought_to_rest_and_taken_up_again() {
    let stale_ticks = 10;
    run(|run| {
        let (error, step, _) = undisturbed(run);
        // Shorter gaps are bridged with the last rate.
        run.stream(LAP / 8);
        let held = Request { fresh: false, ..Request::stream(path(run.now)) };
        let gap = run.ticks(stale_ticks - 1, &held);
        assert_eq!(all_status(&gap), [0]);
        run.now += stale_ticks - 1;
        let (before, bridged) = (gap[gap.len() - 1], run.stream(LAP / 16));
        assert_eq!(all_status(&bridged), [0]);
        let (gap_nm, error_nm, step_mv) = (worst(&gap) * 1e9, error * 1e9, largest_step(&before, &bridged) * 1e3);
        let step_before = step * 1e3;
        println!("bridged gap: {gap_nm:.1} nm ({error_nm:.1}), step {step_mv:.1} mV ({step_before:.1})");
        assert!(worst(&gap) < 2.0 * error && largest_step(&before, &bridged) < 2.0 * step);

        let held = Request { fresh: false, ..Request::stream(path(run.now)) };
        let dry = run.ticks(3000, &held);
        let bits: Vec<u32> = dry.iter().map(|tick| tick.status).collect();
        assert!(bits[..stale_ticks - 1].iter().all(|bits| *bits == 0), "{bits:x?}");
        assert!(bits[stale_ticks - 1..].iter().all(|bits| bits & !BUSY == STALE), "{bits:x?}");
        let resting = dry.iter().position(|tick| tick.status == STALE).expect("it comes to rest");
        assert!(dry[resting..].iter().all(|tick| tick.target == dry[resting].target && tick.status == STALE));
        println!("at rest {resting} ticks after the last set-point; held to {:.1} nm", worst(&dry[2000..]) * 1e9);
        assert!(resting < 1000 && worst(&dry) < 2.0 * error && worst(&dry[2000..]) < 20e-9);

        // The path is elsewhere by now: every set-point is a jump, until one is near.
        let rest = dry[dry.len() - 1];
        run.now += LAP / 4;
        let refused = run.stream(20);
        assert!(
            refused.iter().all(|tick| tick.status & REFUSED != 0 && tick.target == rest.target),
            "{:x?}",
            all_status(&refused)
        );
        let bias = emitted().compiled.model.task_space.as_ref().expect("in task space").setpoint.bias;
        let here: [f64; 6] = std::array::from_fn(|k| rest.target[k] - bias[k]);
        let near = Request::stream(PoseTarget { pose: here, ..PoseTarget::default() });
        let taken = run.ticks(1, &near);
        assert_eq!(taken[0].status, 0);
        println!("voltage step on resuming {:.1} mV", largest_step(&refused[19], &taken) * 1e3);
        assert!(largest_step(&refused[19], &taken) < 0.02);
    });
}

#[test]
fn a_set_point_that_jumps_is_no_number_or_lies_outside_is_held() {
    let mut cases: Vec<(String, f64)> = Vec::new();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1.0, 1e300] {
        for name in ["setpoint[0]", "setpoint[4]", "setpoint_rate[2]", "setpoint_rate[5]", "setpoint_acceleration[1]"] {
            // An acceleration of 1 m/s² is one.
            if !(name.contains("acceleration") && bad == 1.0) {
                cases.push((name.to_owned(), bad));
            }
        }
    }
    cases.push(("setpoint[0]".to_owned(), path(LAP / 8).pose[0] + 1e-6));
    run(|run| {
        let (error, step, _) = undisturbed(run);
        // Each of the numbers once in the short run.
        for (name, bad) in cases.into_iter().step_by(length(6, 1)) {
            let before = run.stream(LAP / 8 - (run.now % LAP) + LAP);
            let before = before[before.len() - 1];
            run.force(&name, bad);
            let held = run.stream(1);
            run.release();
            assert_eq!(held[0].status & !BUSY, REFUSED, "{name} = {bad}: {:x}", held[0].status);
            // One bad set-point of a stream that moves on: it stops, and as the path comes back the platform is taken along.
            let stopping = run.stream(40);
            let rest = stopping[39];
            let bias = emitted().compiled.model.task_space.as_ref().expect("in task space").setpoint.bias;
            let mut here =
                PoseTarget { pose: std::array::from_fn(|k| rest.target[k] - bias[k]), ..PoseTarget::default() };
            // Back to the path at the speed of a stream.
            let there = path(run.now).pose;
            for _ in 0..LAP {
                for k in 0..6 {
                    let most = [20e-9, 20e-9, 20e-9, 200e-9, 200e-9, 200e-9][k];
                    here.pose[k] += (there[k] - here.pose[k]).clamp(-most, most);
                }
                let tick = run.ticks(1, &Request::stream(here))[0];
                assert_eq!(tick.status & !BUSY, 0, "{name} = {bad}: {:x}", tick.status);
            }
            assert_eq!(here.pose, there);
            let again = run.stream(LAP);
            assert_eq!(all_status(&again), [0]);
            let peak = worse(worst(&held), worst(&stopping));
            let steps = largest_step(&before, &[&held[..], &stopping[..]].concat());
            let (peak_nm, before, steps_mv, step_before) = (peak * 1e9, error * 1e9, steps * 1e3, step * 1e3);
            let at_rest = rest.status & BUSY == 0;
            println!(
                "{name} = {bad:e}: {peak_nm:.0} nm ({before:.1}), steps {steps_mv:.1} mV ({step_before:.1}), at rest: {at_rest}"
            );
            assert!(peak < 2.0 * error && steps < 2.0 * step);
        }
    });
}

#[test]
fn a_stream_that_leaves_the_workspace_stops_at_its_wall() {
    let compiled = &emitted().compiled;
    let bound = compiled.ir.bounds.pose[0];
    run(|run| {
        // 1 mm/s towards a wall: legal steps, up to 50 µm.
        let mut target = PoseTarget::default();
        let mut first = None;
        let mut ticks = Vec::new();
        for tick in 0..700 {
            target.pose[0] = 1e-7 * f64::from(tick);
            target.rate[0] = 1e-3;
            ticks.extend(run.ticks(1, &Request::stream(target)));
            if first.is_none() && target.pose[0] > bound {
                first = Some(ticks.len() - 1);
            }
        }
        let first = first.expect("it goes beyond");
        assert!(ticks[..first].iter().all(|tick| tick.status & REFUSED == 0));
        assert!(ticks[first..].iter().all(|tick| tick.status & REFUSED != 0));
        let end = ticks[699];
        assert!(end.target[0] <= bound && end.target[0] > bound - 2e-6, "{:e}", end.target[0]);
        println!("stands at {:.3} um of {:.3}; {:x?}", end.target[0] * 1e6, bound * 1e6, all_status(&ticks));
        // A move leads back.
        let home = Request { command: Command::Move, ..Request::default() };
        let back = run.ticks(30_000, &home);
        assert_eq!(back[29_999].status, 0);
        assert!(worst(&back[29_000..]) < 50e-9, "{:e}", worst(&back[29_000..]));
    });
}

#[test]
fn unknown_commands_and_selectors_and_moves_out_of_reach_are_refused_and_held() {
    run(|run| {
        let bias = run.ticks(1, &Request::default())[0].target;
        let trajectories =
            emitted().compiled.ir.task_space.as_ref().expect("in task space").setpoints.trajectories.len();
        assert_eq!(trajectories, 3);
        for (command, selector) in
            [(4, 0), (u64::MAX, 0), (1 << 32, 0), (3, 3), (3, u64::from(u32::MAX)), (3, 1 << 32), (3, u64::MAX)]
        {
            run.force_word("command", command);
            run.force_word("selector", selector);
            let held = run.ticks(50, &Request::default());
            run.release();
            assert_eq!(all_status(&held), [REFUSED], "command {command:x}, selector {selector:x}");
            assert!(held.iter().all(|tick| tick.target == bias));
            assert_eq!(all_status(&run.ticks(50, &Request::default())), [0]);
        }
        for (axis, goal) in
            [(0, 51e-6), (2, 43e-6), (2, -63e-6), (4, 0.36e-3), (1, f64::NAN), (5, f64::INFINITY), (3, 1e300)]
        {
            run.force_word("command", 2);
            run.force(&format!("setpoint[{axis}]"), goal);
            let held = run.ticks(50, &Request::default());
            run.release();
            assert_eq!(all_status(&held), [REFUSED], "axis {axis} to {goal}");
            assert!(held.iter().all(|tick| tick.target == bias) && worst(&held) < 50e-9);
        }
        // During a motion: an unknown command stops it, in its place and time.
        let mut goal = PoseTarget::default();
        goal.pose[0] = 10e-6;
        let away = Request { command: Command::Move, target: goal, ..Request::default() };
        let moving = run.ticks(500, &away);
        assert_eq!(all_status(&moving), [BUSY]);
        run.force_word("command", 9);
        let stopped = run.ticks(2000, &away);
        run.release();
        let resting = stopped.iter().position(|tick| tick.status == REFUSED).expect("it comes to rest");
        assert!(stopped[..resting].iter().all(|tick| tick.status == REFUSED | BUSY));
        assert!(stopped[resting..].iter().all(|tick| tick.status == REFUSED && tick.target == stopped[resting].target));
        assert!(stopped[resting].target[0] > moving[499].target[0] && stopped[resting].target[0] < 10e-6);
        println!("stopped after {resting} ticks, {:.1} nm off at most", worst(&stopped) * 1e9);
        let arrived = run.ticks(4000, &away);
        assert_eq!((arrived[3999].status, arrived[3999].target[0]), (0, 10e-6));
    });
}

#[test]
fn a_wrench_that_cannot_be_is_not_believed() {
    run(|run| {
        run.set(&[("interaction", 2.0)]);
        run.ticks(500, &Request::default());
        run.bench.rig().plant_mut().touch(WorkPart::glass());
        let (error, step, last) = undisturbed(run);
        let load = |run: &Run| {
            let place = run.description.output("load[0]").expect("a word");
            (0..6).map(|k| run.description.scalar.decode(run.bench.output()[place + k])).collect::<Vec<_>>()
        };
        let before = load(run);
        for (axis, bad) in
            [(0, f64::NAN), (2, f64::INFINITY), (5, f64::NEG_INFINITY), (1, 1e300), (2, 3601.0), (3, -361.0)]
        {
            run.force(&format!("wrench[{axis}]"), bad);
            let faulty = run.ticks(200, &Request { fresh: true, ..Request::stream(path(run.now)) });
            run.release();
            assert_eq!(all_status(&faulty), [WRENCH], "wrench[{axis}] = {bad}");
            let during = load(run);
            let apart = before.iter().zip(&during).map(|(a, b)| (a - b).abs()).fold(0.0, worse);
            let after = run.ticks(200, &Request { fresh: true, ..Request::stream(path(run.now)) });
            assert_eq!(all_status(&after), [0]);
            let (apart_nm, worst_nm, before) = (apart * 1e9, worse(worst(&faulty), worst(&after)) * 1e9, error * 1e9);
            let (steps, step_before) = (largest_step(&last, &[&faulty[..], &after[..]].concat()) * 1e3, step * 1e3);
            println!(
                "wrench[{axis}] = {bad:e}: load apart by {apart_nm:.2} nm, {worst_nm:.1} nm ({before:.1}), steps {steps:.1} mV ({step_before:.1})"
            );
            assert!(worse(worst(&faulty), worst(&after)) < 2.0 * error && apart < 20e-9);
            assert!(largest_step(&last, &[&faulty[..], &after[..]].concat()) < 0.2);
        }
    });
}

#[test]
fn any_change_of_mode_in_motion_is_without_a_jump() {
    run(|run| {
        let (error, step, _) = undisturbed(run);
        println!("undisturbed: {:.1} nm, {:.1} mV a tick", error * 1e9, step * 1e3);
        // In the short run between P, F and P/F.
        let modes = length(&[0, 3, 6][..], &[0, 1, 2, 3, 4, 5, 6]);
        for &from in modes {
            for &to in modes {
                if from == to {
                    continue;
                }
                run.set(&[("mode", f64::from(from))]);
                let settled = run.stream(LAP);
                let last = settled[LAP - 1];
                let own = worst(&settled[LAP / 2..]);
                run.set(&[("mode", f64::from(to))]);
                let change = run.stream(2 * LAP);
                let jump = largest_step(&last, &change[..1]);
                let (jump_mv, steps, own_nm) = (jump * 1e3, largest_step(&last, &change) * 1e3, own * 1e9);
                let (soon, later) = (worst(&change[..500]) * 1e9, worst(&change[LAP..]) * 1e9);
                let status = all_status(&change);
                println!(
                    "mode {from} to {to}: jump {jump_mv:.1} mV, steps {steps:.1} mV; {own_nm:.0} nm before, {soon:.0} nm within 50 ms, {later:.0} nm after 0.2 s; {status:x?}"
                );
                // A code's worth, for the inverse of what a code gives may be that code or, by rounding, its neighbour.
                assert!(jump <= CODE, "mode {from} to {to}: {jump} V");
                assert!(largest_step(&last, &change) < 0.2 && all_status(&change) == [0]);
                // Invhys has an error of its own, which the next mode finds and takes out; else nothing is disturbed.
                let quiet = from != 1 && to != 1;
                let most = if quiet { 0.3e-6 } else { 2e-6 };
                assert!(worst(&change[..500]) < most, "mode {from} to {to}: {}", worst(&change[..500]));
                assert!(to == 1 || worst(&change[LAP..]) < 0.15e-6);
                if quiet && [2, 3, 5, 6].contains(&to) {
                    assert!(worst(&change[..500]) < 2.0 * error, "mode {from} to {to}: estimates take over unseen");
                }
            }
        }
    });
}

#[test]
fn settings_changed_in_flight_make_no_jump_and_bad_ones_change_nothing() {
    run(|run| {
        let (error, step, _) = undisturbed(run);
        run.bench.rig().plant_mut().touch(WorkPart::glass());
        run.stream(LAP / 2);
        let changes: [(&str, &[(&str, f64)]); 9] = [
            ("measured", &[("interaction", 2.0)]),
            (
                "modelled",
                &[("interaction", 1.0), ("environment_stiffness[0]", 2.4e6), ("environment_stiffness[2]", 3e6)],
            ),
            ("none", &[("interaction", 0.0)]),
            ("modelled again", &[("interaction", 1.0)]),
            ("softer", &[("environment_stiffness[0]", 1e6), ("environment_stiffness[2]", 1e6)]),
            ("none again", &[("interaction", 0.0)]),
            ("half the gains", &[("kp[0]", 2.5e5), ("ki[0]", 9e8), ("ki[2]", 3.5e9)]),
            ("slow adaptation", &[("level_weight", 0.01), ("drift_weight", 0.0004)]),
            ("damping", &[("kv[0]", 300.0), ("kv[2]", 500.0)]),
        ];
        for (what, settings) in changes {
            let before = run.stream(LAP / 4);
            run.set(settings);
            let change = run.stream(LAP);
            let jump = largest_step(&before[before.len() - 1], &change[..1]) * 1e3;
            let (steps, step_before) = (largest_step(&before[before.len() - 1], &change) * 1e3, step * 1e3);
            let (soon, later) = (worst(&change[..500]) * 1e9, worst(&change[LAP / 2..]) * 1e9);
            let before_nm = error * 1e9;
            println!(
                "{what}: jump {jump:.1} mV, steps {steps:.1} mV ({step_before:.1}), {soon:.0} nm within 50 ms, {later:.0} nm after ({before_nm:.1})"
            );
            let jump = largest_step(&before[before.len() - 1], &change[..1]);
            // A gain times the present error is no jump, but no bumpless change either.
            let most = if settings.iter().any(|(name, _)| name.starts_with('k')) { 2.0 * step } else { 1.01 * step };
            assert!(jump < most, "{what}: {jump} V");
            assert!(worst(&change) < 0.2e-6 && worst(&change[LAP / 2..]) < 0.12e-6, "{what}");
            assert_eq!(all_status(&change), [0], "{what}");
        }
    });
    // Refused settings leave no trace, to the bit.
    let voltages = |disturb: bool| {
        let mut all = Vec::new();
        run(|run| {
            for name in ["mode", "interaction", "kp[0]", "ki[5]", "environment_rest[2]", "code_max", "level_weight"] {
                if disturb {
                    let mut bad = run.config.clone();
                    let place = run.description.config_names.iter().position(|known| known == name).expect("a setting");
                    bad[place] = f64::NAN.to_bits();
                    run.orders.borrow_mut().bad_config = Some(bad);
                }
                all.extend(run.stream(100).iter().flat_map(|tick| tick.voltage.map(f64::to_bits)));
            }
        });
        all
    };
    assert!(voltages(true) == voltages(false));
}

#[test]
fn narrower_voltage_limits_are_kept_to_at_the_slew_rate_and_left_without_windup() {
    run(|run| {
        let (error, ..) = undisturbed(run);
        let output = |run: &Run, leg: usize| {
            run.bench.output()[run.description.output("dac_code[0]").expect("a word") + leg] as i64
        };
        let highest = (0..6).map(|leg| output(run, leg)).max().expect("legs");
        let limit = highest * 4 / 5;
        run.set(&[("code_max", limit as f64)]);
        let mut bits = 0;
        for tick in 0..LAP {
            let status = run.stream(1)[0].status;
            bits |= status;
            // 1747 codes a tick bring any leg within 43691 codes in 26 ticks.
            if tick >= 26 {
                assert!((0..6).all(|leg| output(run, leg) <= limit), "tick {tick}");
            }
        }
        assert!(bits & 0x3f != 0 && bits & !0x3f == 0, "{bits:x}");
        run.set(&[("code_max", emitted().compiled.ir.actuation.code_max as f64)]);
        let after = run.stream(2 * LAP);
        let (soon, later, before) = (worst(&after) * 1e9, worst(&after[LAP..]) * 1e9, error * 1e9);
        println!("limits: {soon:.0} nm on return, {later:.1} nm after 0.2 s ({before:.1} before)");
        assert_eq!(all_status(&after[LAP..]), [0]);
        assert!(worst(&after[LAP..]) < 1.3 * error && worst(&after) < 5e-6);
    });
}
