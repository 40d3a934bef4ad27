//! `driftless stress`: stiff and extreme scenes by every method, and what becomes of them.

use super::failure::{Exit, Failure};
use super::flags::StressFlags;
use super::interrupt;
use super::output::{name_files, print, print_object};
use super::progress::SweepProgress;
use crate::report;
use crate::run::Folder;
use crate::run::files::{STRESS, STRESS_RECORD};
use crate::run::stress::{Case, Expected, Stress, StressLine, Verdict, stress};
use crate::scene::{read_text, source_name};

/// The files it may leave; those of an earlier one in the same folder go with it.
const FILES: &[&str] =
    &[STRESS, STRESS_RECORD, "matrix.png", "stability_gauss16.png", "stability_rattle4.png"];
#[cfg(feature = "charts")]
const MATRIX: &str = "matrix";
/// The methods whose stability is drawn, and the files.
#[cfg(feature = "charts")]
const STABILITY: [(&str, &str); 2] = [("gauss16", "stability_gauss16"), ("rattle4", "stability_rattle4")];

/// Runs the shipped set, or the scenes given.
///
/// # Errors
/// A scene or folder that cannot be read or written, an interruption, or a wrong answer.
pub fn run(flags: &StressFlags) -> Result<(), Failure> {
    interrupt::listen()?;
    let plan = plan(flags)?;
    let mut folder = Folder::open(&flags.out.join("stress"), flags.force)?;
    let mut progress = SweepProgress::new("stress", 0, plan.count() as u64, flags.tell.quiet);
    let lines = stress(&plan, &mut |finished| {
        progress.see(finished as u64);
        !interrupt::is_asked()
    });
    progress.finish();
    publish(&plan, &lines, &mut folder, flags)?;
    if interrupt::is_asked() {
        let text = format!(
            "interrupted after {} of {} scenes; what they came to is kept",
            lines.len(),
            plan.cases.len()
        );
        return Err(Failure::new(Exit::Interrupted, text));
    }
    let wrong =
        lines.iter().flat_map(|line| &line.cells).filter(|cell| cell.verdict == Verdict::Wrong).count();
    if wrong > 0 {
        let text = format!(
            "{wrong} wrong answers were given for right\nhint: please report the scenes and methods named"
        );
        return Err(Failure::new(Exit::Other, text).told());
    }
    Ok(())
}

fn plan(flags: &StressFlags) -> Result<Stress, Failure> {
    let usual = Stress::default();
    let cases = if flags.scenes.is_empty() {
        usual.cases
    } else {
        let case = |path: &std::path::PathBuf| {
            let origin = source_name(path);
            let name =
                path.file_stem().map_or_else(|| origin.clone(), |stem| stem.to_string_lossy().into_owned());
            Ok(Case {
                name,
                origin,
                text: read_text(path)?,
                tolerance: flags.tolerance,
                expected: Expected::Unknown,
            })
        };
        flags.scenes.iter().map(case).collect::<Result<_, Failure>>()?
    };
    let methods = if flags.methods.is_empty() { usual.methods } else { flags.methods.clone() };
    Ok(Stress {
        cases,
        methods,
        max_evaluations: flags.max_evaluations,
        threads: flags.threads.map_or(0, usize::from),
    })
}

fn publish(
    plan: &Stress,
    lines: &[StressLine],
    folder: &mut Folder,
    flags: &StressFlags,
) -> Result<(), Failure> {
    if flags.force {
        folder.clear(FILES)?;
    }
    folder.write(STRESS, report::stress::csv(lines).as_bytes())?;
    #[cfg(feature = "charts")]
    draw(plan, lines, folder, flags)?;
    let mut object = report::stress::object(plan, lines);
    folder.write(STRESS_RECORD, format!("{object:#}\n").as_bytes())?;
    if flags.tell.json {
        name_files(&mut object, folder);
        return print_object(&object);
    }
    if flags.tell.quiet {
        Ok(())
    } else {
        print(&(report::stress::text(plan, lines) + &report::result::files(folder.path(), folder.names())))
    }
}

#[cfg(feature = "charts")]
fn draw(
    plan: &Stress,
    lines: &[StressLine],
    folder: &mut Folder,
    flags: &StressFlags,
) -> Result<(), Failure> {
    use crate::run::stress::stability;
    if flags.charts.no_charts {
        return Ok(());
    }
    flags.charts.keep(folder, MATRIX, &report::stress::matrix(plan, lines)?, &flags.tell)?;
    for (name, file) in STABILITY {
        let Some(method) = plan.methods.iter().find(|method| method.info().name == name) else { continue };
        let mut progress: Option<SweepProgress> = None;
        let map = stability(*method, &mut |finished, count| {
            let bar =
                progress.get_or_insert_with(|| SweepProgress::new(name, 0, count as u64, flags.tell.quiet));
            bar.see(finished as u64);
            !interrupt::is_asked()
        });
        if let Some(bar) = &progress {
            bar.finish();
        }
        if let Some(map) = map {
            flags.charts.keep(folder, file, &report::stress::stability(&map)?, &flags.tell)?;
        }
    }
    Ok(())
}
