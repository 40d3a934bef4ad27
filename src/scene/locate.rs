//! Where in a JSON text a value stands.
