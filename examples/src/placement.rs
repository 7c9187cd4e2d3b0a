//! Where to put an object so that a recorded hand gets hold of it.

use glove_io::hand::HandModel;

use crate::{
    grasp::Phase,
    motion::{Motion as _, Recording},
    session::{self, SessionError, SessionOptions},
    soft_body::SoftBody,
};

/// Rate of the rehearsals, frames per second.
const REHEARSAL_HZ: f64 = 25.0;
/// Places that are tried.
const REHEARSALS: usize = 16;

/// Rehearses the recording with the object in each of the likeliest places and
/// keeps the one where the object is longest elastic, or else longest attached, or
/// else longest touched.
///
/// # Errors
///
/// [`SessionError`] if the recording cannot be played.
pub fn place(
    recording: Recording,
    model: &HandModel,
    object: &SoftBody,
    options: &SessionOptions,
) -> Result<Recording, SessionError> {
    let seconds = options.frames as f64 * options.frame_s;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive number of frames, below that of the session"
    )]
    let frames = (seconds * REHEARSAL_HZ).ceil() as usize;
    let rehearsal = SessionOptions {
        frames: frames.min(options.frames),
        frame_s: options.frame_s.max(1.0 / REHEARSAL_HZ),
        fault: None,
        ..*options
    };
    let mut best = None;
    for place in recording
        .candidate_places(model)
        .into_iter()
        .take(REHEARSALS)
    {
        let candidate = recording.clone().with_object_at(place);
        let outcome = session::run(&rehearsal, &candidate, model, object.clone(), |_, _| ())?;
        let count = |wanted: fn(&crate::report::FrameRecord) -> bool| {
            outcome.frames.iter().filter(|f| wanted(f)).count()
        };
        let merit = (
            count(|f| f.phase == Phase::Deforming),
            count(|f| f.phase == Phase::Attached),
            count(|f| f.touching.contains(&true)),
        );
        if best.as_ref().is_none_or(|&(most, _)| merit > most) {
            best = Some((merit, place));
        }
    }
    let place = best.map_or_else(|| recording.object_place(), |(_, place)| place);
    Ok(recording.with_object_at(place))
}
