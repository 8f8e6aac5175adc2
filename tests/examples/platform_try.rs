use host_sim::controller::{Controller, TickController};
use host_sim::platform::{PlatformScenario, Specimen, WorkPart};
use host_sim::platform::rig::{Noise, RunOptions};
use host_sim::platform::scenario::*;
use host_sim::trajectory::*;
fn main() {
    let lib = std::env::args().nth(1).unwrap();
    let mut c = Controller::load(lib.as_ref()).unwrap();
    println!("{} words", c.description().output_names.len());
    let s = Specimen::reference();
    let o = RunOptions::new(1e-4, [0.0,0.0,10e-6,0.0,0.0,0.0]);
    let sc = PlatformScenario::new(&s, &Noise::of(&s), 1, o);
    let z=[0.0,0.0,0.0]; let _=z;
    let pr = |p:[f64;3],d:[f64;3]| host_sim::platform::Probe{point:p,direction:d,plane_point:[p[0],p[1],0.0],plane_normal:d};
    let mut sc = sc;
    let r = sc.rig().clone().with_probes([
        pr([0.08,0.0,0.18],[0.0,0.0,1.0]), pr([-0.04,0.069282,0.18],[0.0,0.0,1.0]), pr([-0.04,-0.069282,0.18],[0.0,0.0,1.0]),
        pr([0.08,0.0,0.18],[0.0,1.0,0.0]), pr([-0.08,0.0,0.18],[0.0,1.0,0.0]), pr([0.0,0.08,0.18],[1.0,0.0,0.0])]);
    *sc.rig_mut() = r;
    if std::env::args().nth(2).is_some() {
        let mut o = sc.options.clone(); o.record = host_sim::platform::rig::Record::Samples;
        let mut s2 = sc.clone(); s2.options = o;
        select(&mut c, 3).unwrap();
        let t = PaperPose { path: PaperPath::Case1, reading: Reading::Corrected, frequency: 1.0 };
        let r = s2.run(&mut c, &t).unwrap();
        println!("arming {}", r.arming);
        for (k, x) in r.samples.iter().enumerate() { if k % 100 == 0 && k < 2000 { println!("{:.4} tz {:.3} ez {:.1} meas {:.1} ex {:.1} tgt {:.3} st {:x} v {:?}", x.time, x.target[2]*1e6, (x.target[2]-x.tick.pose[2])*1e9, (x.target[2]-x.tick.measured[2])*1e9, (x.target[0]-x.tick.pose[0])*1e9, x.tick.target[2]*1e6, x.tick.status, x.tick.voltage.map(|v| v.round())); } }
        return;
    }
    for f in [1.0, 10.0] {
        let t = PaperPose { path: PaperPath::Case1, reading: Reading::Corrected, frequency: f };
        let named = [NamedTrajectory { name: "case-1", frequency: f, trajectory: &t }];
        println!("{}", sc.free_motion(&mut c, &PLATFORM_MODES, &named).unwrap().to_text());
    }
    let t = PaperPose { path: PaperPath::Machining, reading: Reading::Corrected, frequency: 1.0 };
    println!("{}", sc.machining(&mut c, &PLATFORM_MODES, &[("glass",WorkPart::glass()),("aluminium",WorkPart::aluminium())], &t).unwrap().to_text());
}
