//! A scene, read and compiled.

use crate::errors::{of_equations, of_scene, refused};
use driftless::Mechanism;
use driftless::run::table::header;
use driftless::scene::{Output, OutputNames, Override, Template};
use pyo3::prelude::*;
use std::sync::Arc;

/// A scene with its equations; it does not change.
#[pyclass(frozen, module = "pydriftless._core")]
pub struct Scene {
    pub text: String,
    pub source: String,
    pub set: Vec<String>,
    pub outputs: Vec<String>,
    pub template: Template,
    pub scene: driftless::Scene,
    pub mechanism: Arc<Mechanism>,
}

#[pymethods]
impl Scene {
    #[new]
    pub fn new(
        py: Python<'_>,
        text: String,
        source: String,
        set: Vec<String>,
        outputs: Vec<String>,
    ) -> PyResult<Self> {
        let overrides = set.iter().map(|set| set.parse::<Override>());
        let overrides: Vec<Override> =
            overrides.collect::<Result<_, _>>().map_err(|error| refused(py, &error.to_string()))?;
        let template = Template::new(text.clone(), source.clone(), &overrides);
        let plain = template.scene().map_err(|error| of_scene(py, &error))?;
        let names = OutputNames::of(&plain);
        let mut named = Vec::new();
        for text in &outputs {
            let output = Output::parse(text);
            if let Err(error) = names.bind(&output) {
                return Err(refused(py, &format!("output {text}: {}\nhint: {}", error.problem, error.hint)));
            }
            named.push(output);
        }
        let template = template.with_outputs(named);
        let scene = template.scene().map_err(|error| of_scene(py, &error))?;
        let mechanism = Mechanism::new(&scene).map_err(|error| of_equations(py, &error))?;
        Ok(Self { text, source, set, outputs, template, mechanism: Arc::new(mechanism), scene })
    }

    /// What it is made of again, for pickles.
    pub fn parts(&self) -> (String, String, Vec<String>, Vec<String>) {
        (self.text.clone(), self.source.clone(), self.set.clone(), self.outputs.clone())
    }

    #[getter]
    fn name(&self) -> &str {
        &self.scene.name
    }

    #[getter]
    fn description(&self) -> &str {
        &self.scene.description
    }

    /// Names of the columns of a trajectory, with their units.
    pub fn columns(&self) -> Vec<String> {
        header(&self.mechanism)
    }

    /// The scene as JSON, overrides applied.
    fn json(&self) -> String {
        self.scene.to_input().to_string()
    }
}
