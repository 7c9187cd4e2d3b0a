//! Figures 1 and 2: what free-form deformation is, and direct manipulation.

use ffd_core::{CheckOptions, Constraint, Degree, Frame, Grid, Lattice, PullOptions, Verdict};
use serde_json::json;

use crate::{
    Error, Figure, Settings,
    look::{Panel, sheet, short},
    plane::{Drawing, circle, image_of},
};

/// How far the least determinant is narrowed down.
pub(crate) const WIDTH: f64 = 1e-4;

/// The exact test, with everything it can tell.
pub(crate) fn judge<const D: usize>(lattice: &Lattice<D>) -> Verdict<D> {
    lattice.check(&CheckOptions {
        enclose: Some(WIDTH),
        all_cells: true,
        ..CheckOptions::default()
    })
}

/// A verdict in one or two lines.
pub(crate) fn verdict_lines<const D: usize>(verdict: &Verdict<D>) -> Vec<String> {
    let reason = match (verdict.theorem(), verdict.irregular_cells.len()) {
        (Some(theorem), _) => format!(", by {}", theorem.name()),
        (None, 0) => String::new(),
        (None, 1) => ", 1 cell folds".to_owned(),
        (None, count) => format!(", {count} cells fold"),
    };
    let [low, high] = verdict.min_det;
    vec![
        format!("{}{reason}", verdict.outcome.name()),
        format!("least det J in [{low:.4}, {high:.4}]"),
    ]
}

pub(crate) fn verdict_json<const D: usize>(verdict: &Verdict<D>) -> serde_json::Value {
    json!({
        "verdict": verdict.outcome.name(),
        "theorem": verdict.theorem().map(|theorem| theorem.name()),
        "min_det": verdict.min_det,
        "irregular_cells": verdict.irregular_cells.len(),
    })
}

fn panel(heading: &str, drawing: Drawing, lines: Vec<String>) -> Panel {
    Panel {
        heading: heading.to_owned(),
        image: drawing.image,
        lines,
    }
}

/// Figure 1: control points of four cells are moved, and a circle with them.
pub(crate) fn moved_control_points(settings: &Settings) -> Result<Figure, Error> {
    let grid = Grid::new([Degree::CUBIC; 2], [2, 2], Frame::unit())?;
    let rest = Lattice::at_rest(grid)?;
    let mut moved = rest.clone();
    for (indices, by) in [
        ([3, 3], [0.75, 0.55]),
        ([2, 3], [0.25, 0.65]),
        ([3, 2], [0.70, -0.05]),
        ([1, 3], [-0.60, 0.25]),
        ([1, 1], [-0.25, -0.45]),
        ([2, 1], [0.10, -0.60]),
        ([1, 2], [0.45, 0.20]),
        ([3, 1], [-0.25, 0.30]),
    ] {
        moved.set_displacement(moved.grid().control_point(indices), by)?;
    }
    let curve = circle([1.0, 1.0], 0.75);
    let draw = |lattice: &Lattice<2>| {
        let mut drawing = Drawing::new([-1.4, -1.4], [3.4, 3.4], settings.panel);
        drawing.control_points(lattice);
        drawing.cells(lattice, 1.0);
        drawing.blob(&image_of(&curve, lattice));
        drawing
    };
    let verdict = judge(&moved);
    let panels = [
        panel(
            "(a) Before",
            draw(&rest),
            vec![
                "Red: four cells; grey: control points at rest".to_owned(),
                "Blue: the circle they carry".to_owned(),
            ],
        ),
        panel("(b) After", draw(&moved), verdict_lines(&verdict)),
    ];
    Ok(Figure {
        name: "figure-1",
        title: "Figure 1: free-form deformation in the plane",
        picture: Some(sheet("Figure 1  Control points are moved", 2, &panels)),
        table: None,
        numbers: verdict_json(&verdict),
    })
}

/// Figure 2: a point of a circle is dragged.
pub(crate) fn dragged_point(settings: &Settings) -> Result<Figure, Error> {
    let grid = Grid::new([Degree::CUBIC; 2], [4, 4], Frame::unit())?;
    let rest = Lattice::at_rest(grid)?;
    let centre = [2.0, 2.0];
    let curve = circle(centre, 1.1);
    let at = curve[curve.len() / 8];
    let constraints = [Constraint::new(at, [0.75, 0.55])];
    let mut pulled = rest.clone();
    let pull = pulled.pull(&constraints, &PullOptions::default())?;
    let [low, high] = [[-1.4; 2], [5.4; 2]];
    let draw = |net: &Lattice<2>, object: &Lattice<2>, arrows: bool| {
        let mut drawing = Drawing::new(low, high, settings.panel);
        drawing.control_points(net);
        drawing.cells(net, if arrows { 0.45 } else { 0.8 });
        drawing.blob(&image_of(&curve, object));
        if arrows {
            drawing.constraints(&constraints);
        } else {
            drawing.targets(&constraints);
        }
        drawing
    };
    let verdict = judge(&pulled);
    let farthest = pulled
        .displacements()
        .iter()
        .map(|d| d[0].hypot(d[1]))
        .fold(0.0, f64::max);
    let panels = [
        panel(
            "(a) Setup",
            draw(&rest, &rest, true),
            vec!["A point of the circle, and how far it is to go".to_owned()],
        ),
        panel(
            "(b) Lattice alteration",
            draw(&pulled, &rest, true),
            vec![
                "The least change that does it".to_owned(),
                format!("(control points move by {farthest:.2} at most)"),
            ],
        ),
        panel(
            "(c) Deformation",
            draw(&pulled, &pulled, false),
            verdict_lines(&verdict),
        ),
    ];
    let mut numbers = verdict_json(&verdict);
    numbers["largest_residual"] = json!(pull.largest_residual);
    numbers["farthest_control_point"] = json!(farthest);
    Ok(Figure {
        name: "figure-2",
        title: "Figure 2: direct manipulation in the plane",
        picture: Some(sheet(
            "Figure 2  A point is dragged, control points follow",
            3,
            &panels,
        )),
        table: Some(format!(
            "The point is met to {}; the control points move by at most {}.\n",
            short(pull.largest_residual),
            short(farthest)
        )),
        numbers,
    })
}
