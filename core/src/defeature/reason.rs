//! Why a feature was left.

/// Why a feature was left as it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Reason {
    /// The surfaces around it do not meet within its extent.
    #[error("the faces around it do not meet where it is")]
    NoMeeting,
    /// It has more neighbours than are looked at.
    #[error("it borders on too many faces")]
    Neighbours,
    /// New edges cross others.
    #[error("the continued faces would cross their own outline")]
    Crossing,
    /// A face that is not flat would become smaller.
    #[error("a face that is not flat would become smaller")]
    Sense,
    /// The faces' new pieces do not close.
    #[error("the continued faces do not close")]
    Open,
    /// A face next to it is no plane, cylinder, cone or sphere.
    #[error("a face around it is no plane, cylinder, cone or sphere")]
    Surface,
    /// Its wall does not go all around, or is met by other walls.
    #[error("its wall is open on a side, or other walls meet it")]
    Walls,
    /// The continued faces would meet other surface.
    #[error("the continued faces would pass through another part of the surface")]
    Pierced,
    /// The surface that goes and the one that comes enclose no volume, or one on the wrong side.
    #[error("its removal would not change the part")]
    Unchanged,
    /// An edge would have four faces.
    #[error("an edge would belong to more than two triangles")]
    NotManifold,
    /// Another feature next to it was removed in every round.
    #[error("other features were removed beside it until the last round")]
    Rounds,
}
