//! The native part of pydriftless: scenes, runs, sweeps and the program, as Python objects.
//!
//! Nothing is decided here: every function calls the crate and hands arrays, words and JSON over.  The
//! global lock is released while anything is integrated.

mod beside;
mod errors;
mod event;
mod request;
mod run;
mod scene;
mod stepper;
mod sweep;

use driftless::cli;
use pyo3::prelude::*;

/// Runs the program with these arguments, of which the first is its name; returns the exit code.
#[pyfunction]
fn main(py: Python<'_>, arguments: Vec<String>) -> u8 {
    py.detach(|| {
        let code = match cli::parse(arguments.into_iter().map(Into::into)) {
            Ok(flags) => cli::run(&flags).map_or_else(|failure| failure.tell(flags.is_json()), |()| 0.into()),
            Err(exit) => exit,
        };
        // An exit code tells its number only to the system.
        (0..=u8::MAX).find(|&number| std::process::ExitCode::from(number) == code).unwrap_or(1)
    })
}

/// Native part of pydriftless.
#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(main, module)?)?;
    module.add_function(wrap_pyfunction!(run::run, module)?)?;
    module.add_function(wrap_pyfunction!(run::resume, module)?)?;
    module.add_function(wrap_pyfunction!(stepper::stream, module)?)?;
    module.add_function(wrap_pyfunction!(sweep::sweep, module)?)?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<run::Raw>()?;
    module.add_class::<stepper::Stepper>()?;
    module.add_class::<event::Moment>()?;
    errors::add(module)
}
