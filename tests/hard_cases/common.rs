//! Scenes, run.

use springfit::clock::Progress;
use springfit::error::{Error, Result};
use springfit::scene::{self, Located, Scene, Source};
use springfit::study::{self, Study, plan};

/// A square of 4 x 4 control points held at y-.
pub const SQUARE: &str = "[geometry]\nshape = \"square\"\ncontrol_points = [4, 4]\n[material]\nyoung = 15e3\n\
                          poisson = 0.3\n[support]\nfaces = [\"y-\"]\n[[load]]\nforce_per_node = [2.0, -1.0]\n\
                          [calibration]\ngamma = 0.1\n";

/// A cube of 4 x 4 x 4 control points held at z-.
pub const CUBE: &str = "[geometry]\nshape = \"cube\"\ncontrol_points = [4, 4, 4]\n[material]\nyoung = 15e3\n\
                        poisson = 0.3\n[support]\nfaces = [\"z-\"]\n[[load]]\nforce_per_node = [2.0, -1.0, 1.0]\n\
                        [calibration]\ngamma = 0.1\n";

/// Reads and checks a scene, as the command line does.
pub fn parse(text: &str) -> std::result::Result<Scene, Located> {
    let source = Source { name: "hard.toml".into(), text: text.into() };
    let scene = scene::parse(&source)?;
    scene::check(&scene).map_err(|error| source.locate(error))?;
    Ok(scene)
}

/// Reads and runs a scene.
pub fn run(text: &str) -> Result<Study> {
    study::run(&parse(text).map_err(|located| located.error)?, &Progress::default())
}

/// A scene that runs.
pub fn runs(text: &str) -> Study {
    let study = run(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let found = &study.calibration;
    assert!(found.fitted.e_rms.is_finite() && found.fitted.e_max.is_finite(), "{text}");
    assert!(found.phi.iter().chain(found.displacements.iter().flatten()).all(|x| x.is_finite()), "{text}");
    study
}

/// The error of a scene that must not run, found by `check` already.
pub fn refused(text: &str) -> Error {
    let planned = match parse(text) {
        Err(located) => Err(located.error),
        Ok(scene) => plan::plan(&scene).map(|_| ()),
    };
    planned.err().unwrap_or_else(|| panic!("nothing is wrong with\n{text}"))
}

/// Message and remedy hold these words.
pub fn says(error: &Error, status: u8, words: &[&str]) {
    let text = format!("{error} / {}", error.help().unwrap_or_default());
    assert_eq!(error.exit_status(), status, "{text}");
    for word in words {
        assert!(text.contains(word), "no {word:?} in {text}");
    }
}

/// The warnings hold these words in one of them.
pub fn warned(warnings: &[String], words: &[&str]) {
    let one = |warning: &&String| words.iter().all(|word| warning.contains(word));
    assert!(warnings.iter().any(|warning| one(&warning)), "no {words:?} in {warnings:?}");
}
