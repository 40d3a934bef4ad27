//! Prints the scene of a chain of N links, one metre and one kilogram in all, that hangs by one end and is
//! let go straight at an angle:
//!
//! `cargo run --release --example chain -- 128 0.5 > chain.json && cargo run --release -- run chain.json --method
//! dop853`

use driftless::scene::{Bar, Hinge, Place, Scene, Start};

/// Every link a thin rod; angles from where the chain hangs straight down \[rad\].
pub fn chain(links: usize, angle: f64) -> Scene {
    let length = 1.0 / links as f64;
    let link = |k: usize| Bar {
        name: format!("link{}", k + 1),
        length,
        mass: length,
        centre: [length / 2.0, 0.0],
        inertia: length * length * length / 12.0,
    };
    let hinge = |k: usize| Hinge {
        name: format!("hinge{}", k + 1),
        between: [
            Place { bar: k.checked_sub(1), point: [if k == 0 { 0.0 } else { length }, 0.0] },
            Place { bar: Some(k), point: [0.0, 0.0] },
        ],
    };
    Scene {
        name: format!("chain{links}"),
        description: format!("A hanging chain of {links} links."),
        gravity: [9.81, 0.0],
        bars: (0..links).map(link).collect(),
        hinges: (0..links).map(hinge).collect(),
        start: vec![Start { phi: angle, omega: 0.0 }; links],
        until: 1.0,
        every: 0.01,
        ..Scene::default()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let links = arguments.next().map_or(Ok(32), |links| links.parse())?;
    let angle = arguments.next().map_or(Ok(0.5), |angle| angle.parse())?;
    println!("{:#}", chain(links, angle).to_input());
    Ok(())
}
