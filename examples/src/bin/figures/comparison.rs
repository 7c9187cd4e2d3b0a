//! Figures 7 and 8: pulls by one lattice, and in steps that cannot fold.

use std::fmt::Write as _;

use examples::{
    mesh_crossings::Crossings,
    raster::{Image, Scene},
};
use ffd_core::{InjectiveOptions, Lattice, PullOptions, Sequence, StepPolicy};
use serde_json::{Value, json};

use crate::{
    Error, Figure, Settings,
    cases::{Case, chain_links, over_constraint, over_extension},
    free_form::judge,
    look::{Panel, sheet, short},
    shapes::Shape,
    solid::{add_constraints, add_shape, add_targets},
};

/// Meshes are not refined beyond this number of triangles.
const MOST_TRIANGLES: usize = 600_000;

const FARTHEST: &str = "No det J below: proven for all steps together. Farthest: how far a point of the net is moved, relative to the longest constraint.";

/// How a pull is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Manner {
    /// One lattice, whether it folds or not.
    Conventional,
    Injective(StepPolicy),
}

impl Manner {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Conventional => "conventional",
            Self::Injective(policy) => policy_name(policy),
        }
    }
}

pub(crate) fn policy_name(policy: StepPolicy) -> &'static str {
    match policy {
        StepPolicy::Paper => "paper",
        StepPolicy::Exact => "exact",
        StepPolicy::Greedy => "greedy",
        _ => "other",
    }
}

/// A pull and what it does to space.
struct Pulled {
    manner: Manner,
    sequence: Sequence<3>,
    achieved: f64,
    /// Of each lattice.
    verdicts: Vec<&'static str>,
    /// Proven: no determinant of all steps together is below.
    least_det: f64,
    /// Between which values the determinants at the vertices of the mesh lie.
    at_vertices: [f64; 2],
    /// The same at the points of a net.
    at_net: [f64; 2],
    /// How far a point of the net is moved at most, relative to the longest constraint.
    farthest: f64,
    meshes: Vec<Refinement>,
}

/// Triangles that cross after a pull, of a mesh and its refinements.
struct Refinement {
    /// Vertices and pairs, from the mesh as it is to the first one without crossings, or the
    /// last that was tried.
    levels: Vec<(usize, usize)>,
    embedded: bool,
}

pub(crate) fn hemispheres(settings: &Settings) -> Result<Figure, Error> {
    figure(
        settings,
        &[over_extension()?, over_constraint()?],
        [
            "figure-7",
            "Figure 7: a squashed hemisphere with and without folds",
            "Figure 7  Pulls of a squashed hemisphere",
        ],
    )
}

pub(crate) fn links(settings: &Settings) -> Result<Figure, Error> {
    figure(
        settings,
        &[chain_links()?],
        [
            "figure-8",
            "Figure 8: a chain with and without folds",
            "Figure 8  Pulls of a chain of separate links",
        ],
    )
}

fn figure(
    settings: &Settings,
    cases: &[Case],
    [name, title, heading]: [&'static str; 3],
) -> Result<Figure, Error> {
    let mut panels = Vec::new();
    let mut maps = String::from(
        "| pull | manner | steps | reached | no det J below | det J at vertices | det J at a net | farthest |\n|---|---|---|---|---|---|---|---|\n",
    );
    let mut meshes = String::from(
        "| pull | vertices | pairs at rest | manner | crossing pairs | refined: vertices (pairs) |\n|---|---|---|---|---|---|\n",
    );
    let mut numbers = serde_json::Map::new();
    for case in cases {
        let shapes = &case.meshes[..if settings.quick { 1 } else { case.meshes.len() }];
        let at_rest: Vec<_> = shapes
            .iter()
            .map(|s| Crossings::of(&s.positions, &s.triangles))
            .collect();
        let mut pulls = Vec::new();
        for &manner in &settings.manners {
            let pulled = pull(case, manner, shapes, settings)?;
            write_map(&mut maps, case, &pulled);
            for (shape, (rest, refinement)) in shapes.iter().zip(at_rest.iter().zip(&pulled.meshes))
            {
                write_mesh(&mut meshes, case, shape, rest, &pulled, refinement);
            }
            pulls.push(pulled);
        }
        numbers.insert(case.name.to_owned(), to_json(&pulls, shapes, &at_rest));
        panels.extend(draw(case, &pulls, settings));
    }
    Ok(Figure {
        name,
        title,
        picture: Some(sheet(heading, 3, &panels)),
        table: Some(format!("{maps}\n{FARTHEST}\n\n{meshes}")),
        numbers: numbers.into(),
    })
}

/// Pulls and measures.
fn pull(
    case: &Case,
    manner: Manner,
    shapes: &[Shape],
    settings: &Settings,
) -> Result<Pulled, Error> {
    let (sequence, achieved) = match manner {
        Manner::Conventional => {
            let mut lattice = Lattice::at_rest(case.grid.clone())?;
            lattice.pull(&case.constraints, &PullOptions::default())?;
            (Sequence::from(lattice), 1.0)
        }
        Manner::Injective(policy) => {
            let options = InjectiveOptions {
                policy,
                ..InjectiveOptions::default()
            };
            let pull = case.grid.injective_pull(&case.constraints, &options)?;
            (pull.sequence, pull.achieved)
        }
    };
    let verdicts: Vec<_> = sequence.lattices().iter().map(judge).collect();
    // det of a product of Jacobians is the product of their determinants.
    let least_det = verdicts.iter().map(|v| v.min_det[0]).product();
    let mut meshes = Vec::new();
    for shape in shapes {
        meshes.push(refine(shape, &sequence, manner)?);
    }
    Ok(Pulled {
        at_vertices: range(&sequence, case.drawn().positions.iter().copied()),
        at_net: range(&sequence, net(case, settings.net)),
        farthest: farthest(case, &sequence, settings.net),
        verdicts: verdicts.iter().map(|v| v.outcome.name()).collect(),
        manner,
        sequence,
        achieved,
        least_det,
        meshes,
    })
}

/// The points of a net over the whole domain.
fn net(case: &Case, pieces: usize) -> impl Iterator<Item = [f64; 3]> {
    let domain = case.grid.domain();
    let side = pieces + 1;
    (0..side * side * side).map(move |i| {
        let at = [i % side, i / side % side, i / (side * side)];
        let u = [0, 1, 2].map(|c| {
            let [low, high] = domain[c];
            low + (high - low) * at[c] as f64 / pieces as f64
        });
        case.grid.frame().to_world(u)
    })
}

fn range(sequence: &Sequence<3>, points: impl Iterator<Item = [f64; 3]>) -> [f64; 2] {
    let dets = points
        .filter_map(|p| sequence.evaluate(p))
        .map(|e| e.determinant);
    dets.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], det| {
        [low.min(det), high.max(det)]
    })
}

fn farthest(case: &Case, sequence: &Sequence<3>, pieces: usize) -> f64 {
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let moved = net(case, pieces).map(|p| {
        let image = sequence.deform_point(p);
        length([0, 1, 2].map(|c| image[c] - p[c]))
    });
    let asked = case.constraints.iter().map(|c| length(c.displacement));
    moved.fold(0.0, f64::max) / asked.fold(0.0, f64::max)
}

fn deformed(shape: &Shape, sequence: &Sequence<3>) -> Result<Shape, Error> {
    let mut image = shape.clone();
    sequence.deform_points::<f64, [f64; 3]>(&mut image.positions)?;
    Ok(image)
}

/// Refines a mesh at rest until its image does not cross itself. A pull that folds is not
/// helped by that.
fn refine(shape: &Shape, sequence: &Sequence<3>, manner: Manner) -> Result<Refinement, Error> {
    let mut shape = shape.clone();
    let mut levels = Vec::new();
    loop {
        let image = deformed(&shape, sequence)?;
        let crossings = Crossings::of(&image.positions, &image.triangles);
        levels.push((shape.positions.len(), crossings.pairs.len()));
        let embedded = crossings.is_embedded();
        if embedded || manner == Manner::Conventional || 4 * shape.triangles.len() > MOST_TRIANGLES
        {
            return Ok(Refinement { levels, embedded });
        }
        shape = shape.refined();
    }
}

fn write_map(table: &mut String, case: &Case, pulled: &Pulled) {
    let interval = |[low, high]: [f64; 2]| format!("{} to {}", short(low), short(high));
    let _infallible = writeln!(
        table,
        "| {} | {} | {} | {:.0} % | {} | {} | {} | {:.2} |",
        case.name,
        pulled.manner.name(),
        pulled.sequence.lattices().len(),
        100.0 * pulled.achieved,
        short(pulled.least_det),
        interval(pulled.at_vertices),
        interval(pulled.at_net),
        pulled.farthest,
    );
}

fn write_mesh(
    table: &mut String,
    case: &Case,
    shape: &Shape,
    rest: &Crossings,
    pulled: &Pulled,
    refinement: &Refinement,
) {
    let finer = refinement.levels[1..].iter();
    let finer: Vec<_> = finer
        .map(|(vertices, pairs)| format!("{vertices} ({pairs})"))
        .collect();
    let _infallible = writeln!(
        table,
        "| {} | {} | {} | {} | {} | {} |",
        case.name,
        shape.positions.len(),
        rest.pairs.len(),
        pulled.manner.name(),
        refinement.levels[0].1,
        finer.join(", "),
    );
}

fn to_json(pulls: &[Pulled], shapes: &[Shape], at_rest: &[Crossings]) -> Value {
    let rest = shapes.iter().zip(at_rest).map(|(shape, crossings)| {
        json!({ "vertices": shape.positions.len(), "triangles": shape.triangles.len(), "crossing_pairs": crossings.pairs.len() })
    });
    let manners = pulls.iter().map(|pulled| {
        let meshes = pulled.meshes.iter().map(|refinement| {
            let levels = refinement.levels.iter();
            let levels = levels
                .map(|(vertices, pairs)| json!({ "vertices": vertices, "crossing_pairs": pairs }));
            json!({ "levels": levels.collect::<Vec<_>>(), "embedded": refinement.embedded })
        });
        let value = json!({
            "steps": pulled.sequence.lattices().len(),
            "achieved": pulled.achieved,
            "verdicts": pulled.verdicts,
            "least_det": pulled.least_det,
            "det_at_vertices": pulled.at_vertices,
            "det_at_net": pulled.at_net,
            "farthest": pulled.farthest,
            "meshes": meshes.collect::<Vec<_>>(),
        });
        (pulled.manner.name().to_owned(), value)
    });
    json!({
        "at_rest": rest.collect::<Vec<_>>(),
        "manners": manners.collect::<serde_json::Map<_, _>>(),
    })
}

/// Constraints, conventional and injective pull: panels A, B and C.
fn draw(case: &Case, pulls: &[Pulled], settings: &Settings) -> Vec<Panel> {
    let shape = case.drawn();
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "less than the width"
    )]
    let height = (case.aspect * settings.panel as f64) as usize;
    let render = |scene: &Scene| -> Image {
        scene.render(&case.camera, settings.panel, height, settings.samples)
    };
    let mut scene = Scene::new();
    add_shape(&mut scene, shape, &[], case.wireframe);
    add_constraints(&mut scene, &case.constraints, case.arrow);
    let mut panels = vec![Panel {
        heading: format!("({}A) Constraints", case.name),
        image: render(&scene),
        lines: vec![
            case.what.to_owned(),
            format!("{} vertices", shape.positions.len()),
        ],
    }];
    for (letter, heading, manner) in [
        ("B", "One lattice", Manner::Conventional),
        (
            "C",
            "In steps that cannot fold",
            Manner::Injective(StepPolicy::Exact),
        ),
    ] {
        let Some(pulled) = pulls.iter().find(|pulled| pulled.manner == manner) else {
            continue;
        };
        let Ok(image) = deformed(shape, &pulled.sequence) else {
            continue;
        };
        let crossings = Crossings::of(&image.positions, &image.triangles);
        let mut marked = vec![false; image.triangles.len()];
        for &triangle in crossings.pairs.as_flattened() {
            marked[triangle] = true;
        }
        let mut scene = Scene::new();
        add_shape(&mut scene, &image, &marked, case.wireframe);
        add_targets(&mut scene, &case.constraints, case.arrow);
        let steps = pulled.sequence.lattices().len();
        let steps = if steps == 1 {
            "1 step".to_owned()
        } else {
            format!("{steps} steps")
        };
        let [low, high] = pulled.at_net;
        panels.push(Panel {
            heading: format!("({}{letter}) {heading}", case.name),
            image: render(&scene),
            lines: vec![
                format!(
                    "{steps}, {} pairs of triangles cross",
                    crossings.pairs.len()
                ),
                format!("det J from {} to {}", short(low), short(high)),
            ],
        });
    }
    panels
}
