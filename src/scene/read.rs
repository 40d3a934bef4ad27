//! JSON to [`Scene`](super::Scene).
/// Why a scene was refused.
pub struct SceneError;
/// Reads a scene.
pub fn read_scene() {}
