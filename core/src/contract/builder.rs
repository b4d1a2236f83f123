//! Profiles and limits made setting by setting.

use crate::contract::loop_class::LoopClass;
use crate::contract::ranges::ProfileError;
use crate::contract::residue_settings::ResidueSettings;
use crate::contract::settings::{
    Bodies, Guarantee, Hollow, KeepAttributes, Limits, OutputFormat, PatchShape, Profile, Sheets, Spill,
};

/// Makes a [`Profile`].
///
/// ```
/// use suture_core::{Guarantee, Profile};
///
/// let profile = Profile::builder().name("thin walls").weld_relative(1e-6).guarantee(Guarantee::Strict).build()?;
/// assert_eq!(profile.weld_relative, 1e-6);
/// assert!(Profile::builder().weld_relative(f64::NAN).build().is_err());
/// # Ok::<(), suture_core::ProfileError>(())
/// ```
#[derive(Clone, Debug, Default)]
#[must_use]
pub struct ProfileBuilder {
    profile: Profile,
}

/// A method for each setting of a profile.
macro_rules! setters {
    ($($setting:ident: $type:ty,)*) => {
        $(
            #[doc = concat!("Sets [`Profile::", stringify!($setting), "`].")]
            pub fn $setting(mut self, $setting: $type) -> Self {
                self.profile.$setting = $setting;
                self
            }
        )*

        #[cfg(test)]
        const SETTERS: &[&str] = &["name", $(stringify!($setting)),*];
    };
}

impl ProfileBuilder {
    /// The profile.
    ///
    /// # Errors
    /// [`ProfileError`] names the first setting whose value means nothing.
    pub fn build(self) -> Result<Profile, ProfileError> {
        self.profile.validate()?;
        Ok(self.profile)
    }

    /// Sets [`Profile::name`].
    pub fn name(mut self, name: impl Into<String>) -> Self {
        self.profile.name = name.into();
        self
    }

    setters! {
        repair: bool,
        weld_relative: f64,
        weld_max_edge_share: f64,
        sew_relative: f64,
        gap_edge_share: f64,
        max_hole_edges: u32,
        max_hole_perimeter_relative: f64,
        max_hole_perimeter_mm: f64,
        max_gap_mm: f64,
        leave_open: Vec<LoopClass>,
        close_sheets: bool,
        fill_holes: bool,
        patch_shape: PatchShape,
        format: OutputFormat,
        attributes: KeepAttributes,
        max_volume_change: f64,
        max_area_change: f64,
        max_box_change_relative: f64,
        skin_reach_relative: f64,
        max_skin_lost: f64,
        max_skin_invented: f64,
        max_cavities_filled: f64,
        max_bodies_lost: u32,
        debris_triangles: u32,
        debris_area_share: f64,
        sheets: Sheets,
        sheet_thickness_relative: f64,
        sheet_thickness_mm: f64,
        max_sheets_share: f64,
        bodies: Bodies,
        hollow: Hollow,
        stack_gap_relative: f64,
        separate: bool,
        max_separation_relative: f64,
        guarantee: Guarantee,
        wrap_max_share: f64,
        wrap_max_move: f64,
        wrap_review_share: f64,
        resolve_crossings: bool,
        check_self_intersections: bool,
        build_volume_mm: [f64; 3],
        thin_wall_mm: f64,
        remove_holes_below_mm: f64,
        remove_fillets_below_mm: f64,
        remove_grooves_below_mm: f64,
        remove_bosses_below_mm: f64,
        residue: ResidueSettings,
        smooth_waves_below_mm: f64,
        smooth_leaves: f64,
        simplify_triangles: u64,
        simplify_ratio: f64,
        simplify_within_mm: f64,
        keep_edges_degrees: f64,
    }
}

impl Profile {
    /// Begins with the profile `default`.
    pub fn builder() -> ProfileBuilder {
        Self::default().to_builder()
    }

    /// Begins with this profile.
    pub fn to_builder(&self) -> ProfileBuilder {
        ProfileBuilder { profile: self.clone() }
    }
}

impl Limits {
    /// The same with so many bytes of memory that the system cannot reclaim.
    #[must_use]
    pub fn with_memory(self, memory_bytes: u64) -> Self {
        Self { memory_bytes, ..self }
    }

    /// The same with so many worker threads; 0 is 1.
    #[must_use]
    pub fn with_threads(self, threads: usize) -> Self {
        Self { threads: threads.max(1), ..self }
    }

    /// The same with this many triangles in a chunk on average; 0 is 1.
    #[must_use]
    pub fn with_chunk_triangles(self, chunk_triangles: u32) -> Self {
        Self { chunk_triangles: chunk_triangles.max(1), ..self }
    }

    /// The same with, or without, a list of every record of the edit in the report.
    #[must_use]
    pub fn with_edit_listed(self, list_edit: bool) -> Self {
        Self { list_edit, ..self }
    }

    /// The same with this way of sorting triangles by place into a spool file.
    #[must_use]
    pub fn with_spill(self, spill: Spill) -> Self {
        Self { spill, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_has_a_setter() {
        let fields = serde_json::to_value(Profile::default()).unwrap();
        let mut setters = ProfileBuilder::SETTERS.to_vec();
        setters.sort_unstable();
        assert_eq!(setters, fields.as_object().unwrap().keys().map(String::as_str).collect::<Vec<_>>());
    }

    #[test]
    fn a_profile_that_means_nothing_is_not_built() {
        let error = Profile::builder().max_area_change(-1.0).build().unwrap_err();
        assert_eq!(error.setting, "max_area_change");
        let cautious = Profile::built_in("cautious").unwrap();
        assert_eq!(cautious.to_builder().build().unwrap(), cautious);
    }
}
