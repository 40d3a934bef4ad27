//! A scene, sixteen starts, and where they truly end.

use driftless::dynamics::elimination::Elimination;
use driftless::dynamics::{Form, Mechanism, Motion, State, Time};
use driftless::scene::{Scene, read_scene};
use driftless::stepping::{Integrator, Seen, Taylor};
use std::path::Path;
use std::sync::Arc;

/// Starts of each scene.
const STARTS: usize = 16;

pub struct Problem {
    pub scene: Scene,
    pub mechanism: Arc<Mechanism>,
    /// The end \[s\].
    pub until: f64,
    pub starts: Vec<Motion>,
    /// The ends by the power series in double-double.
    pub ends: Vec<Motion>,
    /// Whether rates are judged beside angles.
    pub with_rates: bool,
}

impl Problem {
    /// `free`, `gentle`, `spring`, `motor`, `motor_sine`, or a chain: `chain3`, `chain6`.
    pub fn named(name: &str) -> Option<Self> {
        let (scene, until) = match name {
            "free" | "gentle" | "spring" | "motor" | "motor_sine" => (shipped(name), 10.0),
            "chain3" => (chain(3), 10.0),
            // Six bars part neighbours a millionfold in three seconds.
            "chain6" => (chain(6), 3.0),
            _ => return None,
        };
        let mechanism = Arc::new(Mechanism::new(&scene).expect("equations"));
        // Multiples of the golden section spread evenly over [-1, 1].
        let spread = |i: usize| 2.0 * (i as f64 * 0.618_033_988_749_894_9).fract() - 1.0;
        let starts: Vec<Motion> = (0..STARTS)
            .map(|i| {
                let mut motion = mechanism.start(&scene);
                for &body in &mechanism.partition.independent {
                    motion.phi[body] = motion.phi[body] + 5e-4 * spread(STARTS * body + i + 1);
                }
                motion
            })
            .collect();
        let ends = starts.iter().map(|start| exact(&mechanism, start, until)).collect();
        Some(Self { scene, mechanism, until, starts, ends, with_rates: true })
    }

    /// Geometric mean over the starts of the largest difference in an angle or a rate.
    pub fn error(&self, ends: &[Motion]) -> f64 {
        let logs: f64 =
            ends.iter().zip(&self.ends).map(|(end, exact)| self.apart(end, exact).max(1e-18).ln()).sum();
        (logs / ends.len() as f64).exp()
    }

    /// Angles modulo a turn, so that codes that do not count turns are judged alike.
    fn apart(&self, a: &Motion, b: &Motion) -> f64 {
        (0..a.phi.len()).fold(0.0, |worst: f64, k| {
            let angle = (a.phi[k] - b.phi[k]).reduced().0.hi.abs();
            let rate = if self.with_rates { (a.omega[k] - b.omega[k]).hi.abs() } else { 0.0 };
            worst.max(angle).max(rate)
        })
    }

    /// States in the form of the elimination.
    pub fn states(&self) -> Vec<State> {
        let form = Elimination::<0>::new(Arc::clone(&self.mechanism));
        self.starts.iter().map(|start| form.state(start)).collect()
    }
}

fn exact(mechanism: &Arc<Mechanism>, start: &Motion, until: f64) -> Motion {
    let mut problem = Elimination::<0>::new(Arc::clone(mechanism));
    let mut state = problem.state(start);
    let mut statistics = Default::default();
    let mut method = Taylor::reference();
    method
        .advance(&mut problem, &mut state, Time::from(until), &mut statistics, &mut |_, _| Ok(Seen::Kept))
        .expect("an end");
    let mut motion = Motion::default();
    problem.read(&state, &mut motion);
    motion
}

fn shipped(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("examples/scenes/{name}.json"));
    read_scene(&path, &[]).expect("a shipped scene")
}

/// A chain of `n` bars like those of `free`, from π/2 - 0.1 i.
fn chain(n: usize) -> Scene {
    let mut scene = shipped("free");
    for i in 0..n {
        if i >= 2 {
            let mut bar = scene.bars[1].clone();
            bar.name = format!("bar{}", i + 1);
            scene.bars.push(bar);
            let mut hinge = scene.hinges[1].clone();
            hinge.name = format!("hinge{}", i + 1);
            hinge.between[0].bar = Some(i - 1);
            hinge.between[1].bar = Some(i);
            scene.hinges.push(hinge);
            scene.start.push(scene.start[1]);
        }
        scene.start[i].phi = std::f64::consts::FRAC_PI_2 - 0.1 * i as f64;
    }
    scene
}
