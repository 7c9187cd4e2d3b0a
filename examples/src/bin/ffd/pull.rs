use crate::{Answer, Error, cli::Pull};
pub(crate) fn run(_: &Pull) -> Result<Answer, Error> {
    todo!()
}
