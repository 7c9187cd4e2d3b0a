//! Trying a motion out before it is played.
//!
//! A person sees where the object is and how it has changed; a script or a recording
//! does not. So variants of a motion (another place for the object, another grasp)
//! are played quickly, at a low frame rate, and the one that gets the best hold of
//! the object is played for good.

use glove_io::hand::HandModel;

use crate::{
    grasp::{GraspEvent, Phase},
    motion::Motion,
    session::{self, Outcome, SessionError, SessionOptions},
    soft_body::SoftBody,
};

/// Rate of the rehearsals, frames per second.
const REHEARSAL_HZ: f64 = 25.0;

/// The variant in which the object gives way in most grasps, or else for longest, or
/// else is attached or touched for longest; the first of equals. One that cannot be
/// played is not chosen.
///
/// # Errors
///
/// The last [`SessionError`] if no variant can be played. `Ok(None)` if there are none.
pub fn best<M: Motion>(
    variants: impl IntoIterator<Item = M>,
    model: &HandModel,
    object: &SoftBody,
    options: &SessionOptions,
) -> Result<Option<M>, SessionError> {
    let frames_of = |seconds: f64| {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a positive number of frames, at most that of the session"
        )]
        let frames = (seconds * REHEARSAL_HZ).ceil() as usize;
        frames.clamp(1, options.frames)
    };
    let rehearsal = SessionOptions {
        frames: frames_of(options.frames as f64 * options.frame_s),
        frame_s: options.frame_s.max(1.0 / REHEARSAL_HZ),
        fault: None,
        ..*options
    };
    let (mut best, mut failure) = (None, None);
    for variant in variants {
        match session::run(&rehearsal, &variant, model, object.clone(), |_, _| ()) {
            Ok(outcome) => {
                let merit = merit(&outcome);
                if best.as_ref().is_none_or(|&(most, _)| merit > most) {
                    best = Some((merit, variant));
                }
            }
            Err(error) => failure = Some(error),
        }
    }
    match (best, failure) {
        (Some((_, variant)), _) => Ok(Some(variant)),
        (None, Some(error)) => Err(error),
        (None, None) => Ok(None),
    }
}

/// Grasps in which the object gave way, and frames in which it did, was attached,
/// was touched.
fn merit(outcome: &Outcome) -> [usize; 4] {
    let frames_in = |phase| outcome.frames.iter().filter(|f| f.phase == phase).count();
    [
        outcome
            .events
            .iter()
            .filter(|e| e.event == GraspEvent::BecameElastic)
            .count(),
        frames_in(Phase::Deforming),
        frames_in(Phase::Attached),
        outcome
            .frames
            .iter()
            .filter(|f| f.touching.contains(&true))
            .count(),
    ]
}
