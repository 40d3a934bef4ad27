//! What a study of a scene leaves: files in a folder of its own, of which the record comes last, and what is
//! printed.

#[cfg(feature = "charts")]
use super::charts::MotionFlags;
use super::failure::Failure;
use super::flags::{FolderFlags, TellFlags};
use super::output::{name_files, print, print_object};
#[cfg(feature = "charts")]
use crate::chart::{MotionGif, Picture};
use crate::report::result::files;
use crate::run::Folder;
use serde_json::Value;
use std::path::PathBuf;

/// The results of a study.
#[derive(Default)]
pub(super) struct StudyFiles {
    /// Tables and pages, by name.
    pub files: Vec<(&'static str, Vec<u8>)>,
    /// The name of the record, and what is in it.
    pub record: &'static str,
    pub object: Value,
    /// The same for readers.
    pub text: String,
    #[cfg(feature = "charts")]
    pub pictures: Vec<(&'static str, Picture)>,
    #[cfg(feature = "charts")]
    pub motions: Vec<(&'static str, MotionGif)>,
    /// What is missing in them.
    pub failure: Option<Failure>,
}

/// Where the results of a study go.
pub(super) struct StudyFolder<'a> {
    path: PathBuf,
    flags: &'a FolderFlags,
    tell: &'a TellFlags,
    #[cfg(feature = "charts")]
    motion: Option<&'a MotionFlags>,
}

impl<'a> StudyFolder<'a> {
    /// For a study of a scene; asked before its work begins, so that this is not done for nothing.
    ///
    /// # Errors
    /// Results are there already, and are not to be overwritten.
    pub fn new(
        flags: &'a FolderFlags,
        tell: &'a TellFlags,
        scene: &str,
        study: &str,
    ) -> Result<Self, Failure> {
        let path = flags.out.join(scene).join(study);
        if !flags.force {
            Folder::refuse_results(&path)?;
        }
        Ok(Self {
            path,
            flags,
            tell,
            #[cfg(feature = "charts")]
            motion: None,
        })
    }

    /// The same where motions are drawn in the formats that flags ask for.
    #[cfg(feature = "charts")]
    pub fn with_motions(self, flags: &'a MotionFlags) -> Self {
        Self { motion: Some(flags), ..self }
    }

    /// Writes and prints the results of a study; every file that an earlier one `may` have left goes.
    ///
    /// # Errors
    /// A file that cannot be written, with which none is left, or what is missing in the results.
    pub fn publish(self, study: StudyFiles, may: &[&str]) -> Result<(), Failure> {
        let mut folder = Folder::open(&self.path, self.flags.force)?;
        if self.flags.force {
            folder.clear(may)?;
        }
        self.write(&study, &mut folder).inspect_err(|_| folder.take_back())?;
        let StudyFiles { mut object, text, failure, .. } = study;
        name_files(&mut object, &folder);
        if self.tell.json {
            if let Some(failure) = &failure {
                object["error"] = failure.object();
            }
            print_object(&object)?;
        } else if !self.tell.quiet {
            print(&(text + &files(folder.path(), folder.names())))?;
        }
        failure.map_or(Ok(()), |failure| Err(if self.tell.json { failure.told() } else { failure }))
    }

    fn write(&self, study: &StudyFiles, folder: &mut Folder) -> Result<(), Failure> {
        for (name, content) in &study.files {
            folder.write(*name, content)?;
        }
        #[cfg(feature = "charts")]
        {
            for (name, picture) in &study.pictures {
                self.flags.charts.keep(folder, name, picture, self.tell)?;
            }
            for (motion, (name, drawn)) in self.motion.iter().cycle().zip(&study.motions) {
                motion.keep(folder, name, drawn, self.tell)?;
            }
        }
        Ok(folder.write(study.record, format!("{:#}\n", study.object).as_bytes())?)
    }
}
