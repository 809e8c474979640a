//! Designs and draws, for the times and shares while the optimiser is being worked on.
use furuta_ctrl::Config;
use furuta_ctrl::trajectory::WhenLost;
use furuta_design::optimal::SwingUpProblem;
use furuta_design::swing_up::{Outcome, Study};
use furuta_model::Rig;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let draws: usize = a[1].parse().unwrap();
    let names: Vec<&str> = if a.len() > 2 {
        vec![a[2].as_str()]
    } else {
        vec![
            "qube",
            "fong2014-emecs",
            "shahzad2022-srv02",
            "ramos-velasco",
        ]
    };
    let reserve: f64 = a.get(3).map_or(0.15, |s| s.parse().unwrap());
    let effort: f64 = a.get(4).map_or(0.1, |s| s.parse().unwrap());
    for name in names {
        let mut rig = Rig::builtin(if name == "qube" { "qube-servo-2" } else { name }).unwrap();
        if name == "qube" {
            rig.params.pendulum.viscous = 1e-4;
        }
        for fast in [true, false] {
            let p = if fast {
                SwingUpProblem::fastest(rig.clone())
            } else {
                SwingUpProblem {
                    reserve,
                    effort,
                    ..SwingUpProblem::new(rig.clone())
                }
            };
            let t = std::time::Instant::now();
            match p.solve(&|_| ()) {
                Ok(s) => {
                    let r = s.replayed(&rig).unwrap();
                    println!(
                        "{name} fast {fast}: T {:.4} arrival {:.4} cost {:.5} gap {:.1e} opt {} arm {:.2} replay end {:?} in {:.2} s",
                        s.seconds(),
                        s.arrival(0.2),
                        s.cost,
                        s.gap,
                        s.optimal,
                        s.arm(),
                        r.last().unwrap(),
                        t.elapsed().as_secs_f64()
                    );
                    if draws > 0 && !fast {
                        for follow in [false, true] {
                            let config = Config {
                                trajectory: follow.then(|| s.trajectory(WhenLost::Energy).unwrap()),
                                ..Config::default()
                            };
                            let t = std::time::Instant::now();
                            let study = Study {
                                config,
                                ..Study::new(rig.clone(), draws)
                            };
                            let o = Outcome::of(&study.run(&|_| ()).unwrap());
                            println!(
                                "   follow {follow}: up {} of {} caught {:?} arrived {:?} arm {:.2}/{:.2} dropped {:.2} again {} in {:.1}s",
                                o.up,
                                draws,
                                o.time,
                                o.arrival,
                                o.median_arm,
                                o.arm,
                                o.dropped,
                                o.up_again,
                                t.elapsed().as_secs_f64()
                            );
                        }
                    }
                }
                Err(e) => println!("{name}: {e} in {:.2}", t.elapsed().as_secs_f64()),
            }
        }
    }
}
