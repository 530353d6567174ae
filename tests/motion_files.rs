//! The files of a motion, read back: the list of frames, the table, the plots.

use std::fs;
use std::path::Path;

use springfit::clock::Progress;
use springfit::scene::{self, Source};
use springfit::study::{self, Study};
use tempfile::TempDir;
use vtu::floats;

mod vtu;

/// A small membrane that swings, once for each alpha.
fn study(alphas: &str) -> Study {
    let text = format!(
        "name = \"a <small> membrane\"\n[geometry]\nshape = \"square\"\ncontrol_points = [4, 5]\n\
         [material]\nyoung = 15e3\npoisson = 0.3333333333333333\ndensity = 1143.0\n\
         [support]\nfaces = [\"y-\"]\n[[load]]\nforce_per_node = [200.0, -200.0]\n\
         [calibration]\ngamma = 0.5\n\
         [dynamics]\n{alphas}\nduration = 0.5\nstep = 5e-3\nload_until = 0.1\nframes = 25\n"
    );
    let scene = scene::parse(&Source { name: "membrane".into(), text }).expect("a valid scene");
    study::run(&scene, &Progress::default()).expect("a motion")
}

/// The files of a study, by their names relative to the folder.
fn exported(study: &Study, folder: &Path) -> Vec<String> {
    let files = study.export(folder).expect("writable");
    let inside = |file: &Path| file.strip_prefix(folder).expect("inside").to_string_lossy().into_owned();
    files.iter().map(|file| inside(file)).filter(|name| name.starts_with("motion") || name == "strain.svg").collect()
}

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// What stands between `before` and the next quote, everywhere.
fn attributes<'a>(text: &'a str, before: &str) -> Vec<&'a str> {
    text.match_indices(before).map(|(at, _)| text[at + before.len()..].split('"').next().expect("text")).collect()
}

/// The elements of an XML text, each opening tag with its attributes; every one is closed in its order.
fn elements(text: &str) -> Vec<&str> {
    let (mut open, mut found) = (Vec::new(), Vec::new());
    for tag in text.split('<').skip(1) {
        let (tag, between) = tag.split_once('>').expect("a tag ends");
        assert!(!between.contains('>'), "a plain text has no >: {between}");
        let name = |tag: &'_ str| tag.split([' ', '\n', '/']).next().expect("text").to_owned();
        if let Some(closed) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name(closed)), "tags close in their order");
        } else if !tag.starts_with(['?', '!']) {
            assert_eq!(tag.matches('"').count() % 2, 0, "quotes are pairs: {tag}");
            found.push(tag);
            if !tag.ends_with('/') {
                open.push(name(tag));
            }
        }
    }
    assert!(open.is_empty(), "all elements are closed: {open:?}");
    found
}

/// Curves of a plot: lines of more points than a legend or an axis has.
fn curves(text: &str) -> usize {
    let points = |element: &str| attributes(element, "points=\"").iter().any(|p| p.split_whitespace().count() > 10);
    elements(text).into_iter().filter(|element| element.starts_with("polyline") && points(element)).count()
}

#[test]
fn a_series_lists_frames_that_are_there_and_hold_the_displacements() {
    let (study, folder) = (study("alpha = 20.0"), TempDir::new().expect("a folder"));
    let files = exported(&study, folder.path());
    let motion = &study.dynamics.as_ref().expect("it moves").motions[0].motion;
    let series = read(folder.path(), "motion.pvd");
    elements(&series);
    let (times, frames) = (attributes(&series, "timestep=\""), attributes(&series, "file=\""));
    assert_eq!(frames.len(), motion.frames.len());
    assert_eq!(times.iter().map(|t| t.parse().expect("a number")).collect::<Vec<f64>>(), motion.times);
    for (u, name) in motion.frames.iter().zip(frames) {
        assert!(files.iter().any(|file| file == name), "{name} was not reported");
        let text = read(folder.path(), name);
        elements(&text);
        let displacement = study.body.dofs.expand(u);
        assert_eq!(floats(&text, "displacement"), displacement.as_flattened());
        let points = floats(&text, "Points");
        let rest = study.body.positions().as_flattened();
        let sums = rest.iter().zip(displacement.as_flattened()).map(|(x, u)| x + u).collect::<Vec<f64>>();
        assert_eq!(points, sums);
        // the strain of the first spring, from its moved ends
        let spring = &study.lattice.network.springs[0];
        let [a, b] = spring.nodes.map(|node| &points[3 * node as usize..][..3]);
        let length = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let strain = 100.0 * (length / spring.length - 1.0);
        assert!((floats(&text, "strain")[0] - strain).abs() < 1e-10);
    }
    assert!(motion.frames.last().expect("frames").iter().any(|u| u.abs() > 1e-6), "it did move");
}

#[test]
fn a_table_has_a_row_for_each_record() {
    let (study, folder) = (study("alpha = 20.0"), TempDir::new().expect("a folder"));
    exported(&study, folder.path());
    let motion = &study.dynamics.as_ref().expect("it moves").motions[0].motion;
    let text = read(folder.path(), "motion.csv");
    let mut lines = text.lines();
    let columns = "time_s,global_strain_percent,kinetic_J,elastic_J,dissipated_J,work_J";
    assert_eq!(lines.next(), Some(columns));
    let rows: Vec<Vec<f64>> =
        lines.map(|line| line.split(',').map(|cell| cell.parse().expect("a number")).collect()).collect();
    assert_eq!(rows.len(), motion.times.len());
    for (row, i) in rows.iter().zip(0..) {
        let e = &motion.energies[i];
        assert_eq!(row[..], [motion.times[i], motion.strain[i], e.kinetic, e.elastic, e.dissipated, e.work]);
    }
    assert!(rows.last().expect("rows")[4] > 0.0, "the dampers took energy");
}

#[test]
fn plots_have_a_curve_for_each_alpha_and_each_energy() {
    // one alpha twice: the same motion, written once
    let (study, folder) = (study("alphas = [5.0, 20.0, 0.5e2, 20.0]"), TempDir::new().expect("a folder"));
    let files = exported(&study, folder.path());
    let strain = read(folder.path(), "strain.svg");
    assert_eq!(curves(&strain), 3);
    for word in ["alpha = 5 s", "alpha = 20 s", "alpha = 50 s", "a &lt;small&gt; membrane", "time, s"] {
        assert!(strain.contains(word), "{word}");
    }
    for alpha in ["5", "20", "50"] {
        for ending in [".pvd", ".csv", "_energy.svg"] {
            let name = format!("motion_alpha_{alpha}{ending}");
            assert_eq!(files.iter().filter(|file| **file == name).count(), 1, "{name}");
        }
        let energy = read(folder.path(), &format!("motion_alpha_{alpha}_energy.svg"));
        assert_eq!(curves(&energy), 5);
        let frame = format!("motion_alpha_{alpha}/frame_00025.vtu");
        assert!(files.contains(&frame), "{frame}");
    }
}

#[test]
fn what_does_not_move_has_no_files_of_a_motion_and_a_full_folder_is_an_error() {
    let mut still = study("alpha = 20.0");
    let folder = TempDir::new().expect("a folder");
    // a file stands where the folder of the frames should be: the list is not written, for it would name nothing
    fs::write(folder.path().join("motion"), "in the way").expect("writable");
    assert_eq!(still.export(folder.path()).expect_err("in the way").exit_status(), 2);
    assert!(!folder.path().join("motion.pvd").exists());
    fs::remove_file(folder.path().join("motion")).expect("removable");
    still.dynamics.as_mut().expect("it moves").motions.clear();
    assert!(exported(&still, folder.path()).is_empty());
}

#[test]
fn a_body_of_finite_elements_that_moves_is_shown_by_its_cells() {
    let text = "[geometry]\nshape = \"rectangle\"\ncells = [3, 2]\n\
                [material]\nyoung = 15e3\npoisson = 0.3\ndensity = 1143.0\n[support]\nfaces = [\"x-\"]\n\
                [[load]]\nforce_per_node = [0.0, -50.0]\n[reference]\nmethod = \"t3\"\nkinematics = \"corotational\"\n\
                [dynamics]\nmodel = \"reference\"\nsteps = 4\nstep = 1e-3\nframes = 2\n";
    let scene = scene::parse(&Source { name: "membrane".into(), text: text.into() }).expect("a valid scene");
    let study = study::run(&scene, &Progress::default()).expect("a motion");
    let folder = tempfile::tempdir().expect("a folder");
    let files = exported(&study, folder.path());
    let frames: Vec<&String> = files.iter().filter(|name| name.ends_with(".vtu")).collect();
    assert!(frames.len() >= 2, "{files:?}");
    for name in frames {
        // two triangles a cell
        assert_eq!(attributes(&read(folder.path(), name), "NumberOfCells=\""), ["12"], "{name}");
    }
}
