//! Kernel, processors and privileges.

use specgen_rt::clock;
use specgen_rt::scheduling::{FIX_MEMORY, FIX_PRIORITY, MissingPrivilege};

use super::Grade::{Bad, Unknown, Warning};
use super::{Files, Finding};

const CPU: &str = "/sys/devices/system/cpu";

/// Findings from system files.
#[must_use]
pub fn findings(files: &Files) -> Vec<Finding> {
    vec![
        kernel(files),
        clock_source(files),
        governor(files),
        isolation(files),
        idle(files),
        virtual_machine(files),
        throttling(files),
        load(files),
    ]
}

/// Findings about requests for real-time priority and locked memory.
#[must_use]
pub fn rights(priority: Result<(), &MissingPrivilege>, memory: Result<(), &MissingPrivilege>) -> Vec<Finding> {
    let of = |subject, answer: Result<(), &MissingPrivilege>, granted: &str, fix: &str| match answer {
        Ok(()) => Finding::good(subject, granted),
        Err(refused) => Finding::of(subject, Bad, format!("{}: {}", refused.what, refused.cause), fix),
    };
    vec![
        of("priority", priority, "SCHED_FIFO is granted", FIX_PRIORITY),
        of("memory", memory, "can be locked", FIX_MEMORY),
    ]
}

/// Finding about the resolution of the timer.
#[must_use]
pub fn timer() -> Finding {
    match clock::resolution() {
        0 => Finding::of("timer", Unknown, "resolution unknown", "see `cat /proc/timer_list`"),
        1 => Finding::good("timer", "1 ns"),
        coarse => Finding::of(
            "timer",
            Bad,
            format!("{coarse} ns: no high-resolution timers"),
            "boot a kernel with CONFIG_HIGH_RES_TIMERS, without `highres=off` and `nohz=off`",
        ),
    }
}

fn kernel(files: &Files) -> Finding {
    const FIX: &str = "install a PREEMPT_RT kernel: `apt-get install linux-image-rt-amd64` (Debian), `pro enable \
         realtime-kernel` (Ubuntu), kernel-rt (Red Hat); without it delays are not bounded";
    let version = files.text("/proc/sys/kernel/osrelease").unwrap_or_default();
    let build = files.text("/proc/sys/kernel/version").unwrap_or_default();
    if files.text("/sys/kernel/realtime").as_deref() == Some("1") || build.contains("PREEMPT_RT") {
        return Finding::good("kernel", format!("{version}, PREEMPT_RT"));
    }
    if build.is_empty() {
        return Finding::of("kernel", Unknown, "not visible", FIX);
    }
    let kind = build.split_whitespace().find(|word| word.starts_with("PREEMPT")).unwrap_or("no preemption");
    Finding::of("kernel", Warning, format!("{version}, {kind}, not PREEMPT_RT"), FIX)
}

fn clock_source(files: &Files) -> Finding {
    let source = files.text("/sys/devices/system/clocksource/clocksource0/current_clocksource");
    match source.as_deref() {
        None => Finding::of("clock", Unknown, "source not visible", "see `dmesg | grep clocksource`"),
        Some(slow @ ("hpet" | "acpi_pm" | "jiffies" | "refined-jiffies")) => Finding::of(
            "clock",
            Warning,
            format!("{slow}: a reading costs a microsecond or more"),
            "`dmesg | grep -i tsc` shows why the time stamp counter is not used; boot with `tsc=reliable` if it is sound",
        ),
        Some(source) => Finding::good("clock", source),
    }
}

fn governor(files: &Files) -> Finding {
    const FIX: &str = "`cpupower frequency-set -g performance`, at every boot";
    let processors = files.names(CPU, "cpu");
    let governors = processors.iter().filter_map(|cpu| files.text(&format!("{CPU}/{cpu}/cpufreq/scaling_governor")));
    let mut governors: Vec<String> = governors.collect();
    governors.sort();
    governors.dedup();
    match governors.as_slice() {
        [] => Finding::of("frequency", Unknown, "no cpufreq here (virtual machine, or a fixed clock)", FIX),
        [only] if only == "performance" => Finding::good("frequency", "governor performance"),
        found => Finding::of("frequency", Warning, format!("governor {}", found.join(", ")), FIX),
    }
}

fn isolation(files: &Files) -> Finding {
    const FIX: &str = "boot with `isolcpus=N nohz_full=N rcu_nocbs=N` for one processor N and start rt-pc with --cpu N";
    let list = |name: &str| files.text(&format!("{CPU}/{name}")).filter(|text| !text.is_empty() && text != "(null)");
    match (list("isolated"), list("nohz_full")) {
        (Some(isolated), Some(quiet)) => {
            Finding::good("isolation", format!("processors {isolated} isolated, {quiet} without timer ticks"))
        }
        (Some(isolated), None) => {
            Finding::of("isolation", Warning, format!("processors {isolated} isolated, none without timer ticks"), FIX)
        }
        (None, _) if files.text(&format!("{CPU}/online")).is_none() => {
            Finding::of("isolation", Unknown, "not visible", FIX)
        }
        (None, _) => Finding::of("isolation", Warning, "no processor is isolated from other work", FIX),
    }
}

/// Exit latency of a sleep state above which it is a problem, µs.
const SLOW_WAKE: u64 = 10;

fn idle(files: &Files) -> Finding {
    let folder = format!("{CPU}/cpu0/cpuidle");
    let mut slowest = None;
    for state in files.names(&folder, "state") {
        let of = |name: &str| files.text(&format!("{folder}/{state}/{name}"));
        let latency = of("latency").and_then(|text| text.parse::<u64>().ok()).unwrap_or(0);
        if of("disable").as_deref() != Some("1") && slowest.as_ref().is_none_or(|(most, _)| latency > *most) {
            slowest = Some((latency, of("name").unwrap_or(state)));
        }
    }
    match slowest {
        None => Finding::of(
            "sleep states",
            Unknown,
            "no cpuidle here (virtual machine, or `idle=poll`)",
            "on a virtual machine the host controls them; otherwise see /sys/devices/system/cpu/cpuidle",
        ),
        Some((latency, name)) if latency > SLOW_WAKE => Finding::of(
            "sleep states",
            Warning,
            format!("{name} takes {latency} µs to wake from"),
            "rt-pc disables them through /dev/cpu_dma_latency if it may write it; otherwise boot with `processor.max_cstate=1 intel_idle.max_cstate=0`",
        ),
        Some((latency, name)) => Finding::good("sleep states", format!("{name} at most, {latency} µs")),
    }
}

fn virtual_machine(files: &Files) -> Finding {
    let Some(text) = files.text("/proc/cpuinfo") else {
        return Finding::of("hardware", Unknown, "not visible", "see /proc/cpuinfo");
    };
    let flags = text.lines().find(|line| line.starts_with("flags"));
    if flags.is_some_and(|flags| flags.split_whitespace().any(|flag| flag == "hypervisor")) {
        return Finding::of(
            "hardware",
            Warning,
            "a virtual machine: its host can pause it at any time",
            "run directly on the hardware",
        );
    }
    Finding::good("hardware", "no hypervisor detected")
}

fn throttling(files: &Files) -> Finding {
    match files.text("/proc/sys/kernel/sched_rt_runtime_us").and_then(|text| text.parse::<i64>().ok()) {
        None => Finding::of("throttling", Unknown, "not visible", "see /proc/sys/kernel/sched_rt_runtime_us"),
        Some(-1) => Finding::good("throttling", "off"),
        Some(runtime) => Finding::good(
            "throttling",
            format!("real-time threads may use {runtime} µs per second: enough for a loop that sleeps"),
        ),
    }
}

fn load(files: &Files) -> Finding {
    let first = files.text("/proc/loadavg").and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    let online = files.names(CPU, "cpu").iter().filter(|name| name[3..].parse::<u32>().is_ok()).count();
    match first {
        None => Finding::of("load", Unknown, "not visible", "see `uptime`"),
        Some(load) if online > 0 && load > online as f64 => Finding::of(
            "load",
            Warning,
            format!("{load:.1} runnable threads on {online} processors"),
            "end other work, or the figures below are too high",
        ),
        Some(load) => Finding::good("load", format!("{load:.1} on {online} processors")),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::Grade::Good;
    use super::*;

    /// Findings of a computer with these files.
    fn of(files: &[(&str, &str)]) -> Vec<Finding> {
        let root = tempfile::tempdir().unwrap();
        for (path, text) in files {
            let path = root.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        findings(&Files::below(root.path()))
    }

    fn grades(findings: &[Finding]) -> Vec<super::super::Grade> {
        findings.iter().map(|finding| finding.grade).collect()
    }

    #[test]
    fn a_container_without_sys_and_proc_is_unknown_in_everything() {
        let found = of(&[]);
        assert!(
            found.len() > 4 && found.iter().all(|finding| finding.grade == Unknown && finding.fix.is_some()),
            "{found:?}"
        );
    }

    #[test]
    fn a_computer_set_up_for_real_time_is_good_in_everything() {
        let found = of(&[
            ("proc/sys/kernel/osrelease", "6.12.0-rt\n"),
            ("proc/sys/kernel/version", "#1 SMP PREEMPT_RT Debian\n"),
            ("sys/kernel/realtime", "1\n"),
            ("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc\n"),
            ("sys/devices/system/cpu/online", "0-3\n"),
            ("sys/devices/system/cpu/isolated", "3\n"),
            ("sys/devices/system/cpu/nohz_full", "3\n"),
            ("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n"),
            ("sys/devices/system/cpu/cpu0/cpuidle/state0/latency", "0\n"),
            ("sys/devices/system/cpu/cpu0/cpuidle/state0/name", "POLL\n"),
            ("sys/devices/system/cpu/cpu0/cpuidle/state1/latency", "200\n"),
            ("sys/devices/system/cpu/cpu0/cpuidle/state1/disable", "1\n"),
            ("proc/cpuinfo", "flags\t: fpu sse2\n"),
            ("proc/sys/kernel/sched_rt_runtime_us", "-1\n"),
            ("proc/loadavg", "0.10 0.2 0.3 1/100 7\n"),
        ]);
        assert_eq!(grades(&found), [Good; 8], "{found:?}");
        assert!(found.iter().all(|finding| finding.fix.is_none()));
    }

    #[test]
    fn what_adds_latency_is_reported_with_a_fix() {
        let found = of(&[
            ("proc/sys/kernel/osrelease", "6.1.0\n"),
            ("proc/sys/kernel/version", "#1 SMP PREEMPT_DYNAMIC Debian\n"),
            ("sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet\n"),
            ("sys/devices/system/cpu/online", "0-1\n"),
            ("sys/devices/system/cpu/isolated", "\n"),
            ("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n"),
            ("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave\n"),
            ("sys/devices/system/cpu/cpu0/cpuidle/state0/latency", "2\n"),
            ("sys/devices/system/cpu/cpu0/cpuidle/state3/latency", "890\n"),
            ("sys/devices/system/cpu/cpu0/cpuidle/state3/name", "C10\n"),
            ("proc/cpuinfo", "flags\t: fpu hypervisor sse2\n"),
            ("proc/sys/kernel/sched_rt_runtime_us", "950000\n"),
            ("proc/loadavg", "3.50 0.2 0.3 1/100 7\n"),
        ]);
        let words = [
            ("6.1.0, PREEMPT_DYNAMIC, not PREEMPT_RT", "linux-image-rt-amd64"),
            ("hpet", "tsc"),
            ("performance, powersave", "cpupower"),
            ("no processor is isolated", "isolcpus=N"),
            ("C10 takes 890 µs", "max_cstate"),
            ("virtual machine", "hardware"),
            ("950000", ""),
            ("3.5 runnable threads on 2 processors", "other work"),
        ];
        for (finding, (text, fix)) in found.iter().zip(words) {
            assert!(finding.found.contains(text), "{finding:?}");
            assert_eq!(finding.grade == Warning, !fix.is_empty(), "{finding:?}");
            assert!(finding.fix.as_deref().unwrap_or_default().contains(fix), "{finding:?}");
        }
        assert_eq!(found.len(), words.len());
    }
}
