//! The values that each setting of a profile may have. [`Profile::validate`] is the only place that decides on them.

use crate::contract::settings::Profile;

/// A setting of a profile has a value that means nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{setting}` must be {range}, not {value}")]
#[non_exhaustive]
pub struct ProfileError {
    /// The setting's name, as in a profile file.
    pub setting: &'static str,
    /// Its value.
    pub value: f64,
    /// The values it may have, in words.
    pub range: &'static str,
}

/// The values that mean something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Range {
    /// A part of a whole.
    Share,
    /// A bound that may be as large as anyone likes.
    Bound,
}

impl Range {
    fn words(self) -> &'static str {
        match self {
            Self::Share => "a number from 0 to 1",
            Self::Bound => "a finite number from 0 up",
        }
    }

    /// NaN lies in no range.
    fn contains(self, value: f64) -> bool {
        match self {
            Self::Share => (0.0..=1.0).contains(&value),
            Self::Bound => (0.0..=f64::MAX).contains(&value),
        }
    }
}

/// Settings of a profile that are one number, each with its name, value and range. All other fields are named, so that a new one cannot be forgotten.
macro_rules! with_ranges {
    ($profile:expr; $($setting:ident: $range:ident),*; others: $($other:ident),* $(,)?) => {{
        let Profile { $($setting,)* $($other: _),* } = $profile;
        [$((stringify!($setting), *$setting, Range::$range)),*]
    }};
}

impl Profile {
    /// Refuses a profile with a setting that is no number, or beyond the values that mean something.
    ///
    /// # Errors
    /// [`ProfileError`] names the first of these settings, its value and its range.
    pub fn validate(&self) -> Result<(), ProfileError> {
        let sides = self.build_volume_mm.map(|side| ("build_volume_mm", side, Range::Bound));
        let residue = [
            ("residue.tolerance_mm", self.residue.tolerance_mm, Range::Bound),
            ("residue.wait_minutes", self.residue.wait_minutes, Range::Bound),
        ];
        for (setting, value, range) in self.numbers().into_iter().chain(sides).chain(residue) {
            if !range.contains(value) {
                return Err(ProfileError { setting, value, range: range.words() });
            }
        }
        Ok(())
    }

    /// Every setting that is one number, not a whole one and not a choice, with its range.
    fn numbers(&self) -> [(&'static str, f64, Range); 33] {
        with_ranges![
            self;
            weld_relative: Share, weld_max_edge_share: Share, sew_relative: Share, gap_edge_share: Bound,
            max_hole_perimeter_relative: Bound, max_hole_perimeter_mm: Bound, max_gap_mm: Bound,
            max_volume_change: Bound, max_area_change: Bound, max_box_change_relative: Bound,
            skin_reach_relative: Share, max_skin_lost: Share, max_skin_invented: Share, max_cavities_filled: Bound, debris_area_share: Share,
            sheet_thickness_relative: Share, sheet_thickness_mm: Bound, max_sheets_share: Share,
            stack_gap_relative: Share, max_separation_relative: Share, wrap_max_share: Share, wrap_max_move: Bound,
            wrap_review_share: Share, thin_wall_mm: Bound,
            remove_holes_below_mm: Bound, remove_fillets_below_mm: Bound, remove_grooves_below_mm: Bound, remove_bosses_below_mm: Bound,
            smooth_waves_below_mm: Bound, smooth_leaves: Share, simplify_ratio: Share, simplify_within_mm: Bound, keep_edges_degrees: Bound;
            // Counts, each value of whose type means something, 0 and the largest included; several numbers; choices.
            others: name, max_hole_edges, max_bodies_lost, debris_triangles, build_volume_mm, repair, format, attributes, leave_open,
            close_sheets, residue, simplify_triangles, fill_holes, patch_shape, sheets, bodies, hollow, separate, guarantee, resolve_crossings, check_self_intersections,
        ]
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use serde::Deserialize;
    use serde::de::value::{Error as ValueError, MapDeserializer};

    use super::*;
    use crate::contract::error::Error;
    use crate::contract::error::ErrorClass;
    use crate::contract::progress::Quiet;
    use crate::contract::settings::Limits;

    /// The default profile with another value of one setting, as a file would give it.
    fn with(setting: &str, value: f64) -> Profile {
        Profile::deserialize(MapDeserializer::<_, ValueError>::new([(setting, value)].into_iter())).unwrap()
    }

    #[test]
    fn every_built_in_profile_is_valid() {
        for name in Profile::BUILT_IN {
            Profile::built_in(name).unwrap().validate().unwrap();
        }
    }

    /// Goes over the fields that are serialised, so that a new one is tried, too.
    #[test]
    fn every_setting_refuses_what_means_nothing() {
        let fields = serde_json::to_value(Profile::default()).unwrap();
        let settings: Vec<&String> =
            fields.as_object().unwrap().iter().filter(|(_, value)| value.is_f64()).map(|f| f.0).collect();
        assert_eq!(settings.len(), Profile::default().numbers().len());
        for setting in settings {
            for value in [-1.0, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, -f64::MIN_POSITIVE] {
                let error = with(setting, value).validate().unwrap_err();
                assert_eq!(error.setting, setting);
                let line = error.to_string();
                assert!(line.contains(&format!("not {value}")) && line.contains("from 0"), "{line}");
            }
            for value in [0.0, 0.5, 1.0] {
                with(setting, value).validate().unwrap();
            }
        }
    }

    #[test]
    fn each_side_of_a_printer_is_a_length() {
        for k in 0..3 {
            let mut profile = Profile::default();
            profile.build_volume_mm[k] = 250.0;
            profile.validate().unwrap();
            profile.build_volume_mm[k] = -1.0;
            assert_eq!(profile.validate().unwrap_err().setting, "build_volume_mm");
        }
    }

    #[test]
    fn a_share_is_at_most_all_of_it() {
        assert!(with("wrap_max_share", 1.5).validate().unwrap_err().to_string().contains("from 0 to 1, not 1.5"));
        with("max_hole_perimeter_relative", 1e300).validate().unwrap();
    }

    /// A library's user may never have called [`Profile::validate`].
    #[test]
    fn work_under_an_invalid_profile_is_refused() {
        let (input, output) = (Path::new("not there.stl"), Path::new("nor this.stl"));
        let profile = with("max_separation_relative", f64::INFINITY);
        let limits = Limits::default();
        let results = [crate::inspect(input, &profile, &limits, &Quiet), crate::repair(input, output, &profile, &limits, &Quiet)];
        for result in results {
            let error = result.unwrap_err();
            assert!(matches!(error, Error::Profile { .. }) && error.class() == ErrorClass::Refused, "{error}");
            assert!(error.to_string().contains("max_separation_relative"), "{error}");
        }
    }
}
