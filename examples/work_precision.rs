//! Which method for which error: all of them on a scene, at all their settings, in one picture.
//!
//! `cargo run --release --example work_precision -- [SCENE] [SECONDS] [PICTURE]` spends so many seconds on a
//! scene of `examples/scenes/` (`free`, 5) and draws error against run time into `output/work_precision.png`,
//! or to where else the picture shall be.

use driftless::chart::work_precision;
use driftless::dynamics::Mechanism;
use driftless::report::compare::{self as report, CompareChart};
use driftless::run::compare::{Asked, compare};
use driftless::scene::read_scene;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Pixels per point: 960 wide, for a page on a screen.
const RESOLUTION: f64 = 2.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or("free".into());
    let seconds: f64 = arguments.next().map_or(Ok(5.0), |seconds| seconds.parse())?;
    let picture = arguments.next().unwrap_or("output/work_precision.png".into());

    let scene = read_scene(format!("examples/scenes/{name}.json").as_ref(), &[])?;
    let mechanism = Arc::new(Mechanism::new(&scene)?);
    let budget = Duration::try_from_secs_f64(seconds)?;
    let asked = Asked { methods: Vec::new(), stabilize: Vec::new(), until: None, budget, blocks: 9 };
    let begin = Instant::now();
    let comparison = compare(&scene, &mechanism, &asked, &|| begin.elapsed(), &mut |_| {}, &|| false)?;
    print!("{}", report::text(&scene, &mechanism, &comparison));

    let chart = report::chart_data(CompareChart::ErrorTime, &scene, &mechanism, &comparison);
    work_precision(&chart, RESOLUTION)?.write(Path::new(&picture))?;
    println!("wrote {picture}");
    Ok(())
}
