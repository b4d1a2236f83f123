//! Where a shared store is. Its password is for the database alone: nothing that is shown, logged or noted has it.

use std::fmt;

/// The address of a database, as `postgres://user@host/database?sslmode=verify-full`.
#[derive(Clone, PartialEq, Eq)]
pub struct Address(String);

impl Address {
    /// Takes an address as it was written. Whether there is a database is not asked.
    ///
    /// # Errors
    /// A line for people, without the password.
    pub fn parse(text: &str) -> Result<Self, String> {
        let address = Self(text.to_owned());
        let is_graphic = text.bytes().all(|byte| byte.is_ascii_graphic());
        match address.rest() {
            Some(rest) if is_graphic && !rest.is_empty() => Ok(address),
            Some(_) => {
                Err(format!("`{address}` is no address of a database: write spaces and other letters as %20 and the like"))
            }
            None => Err(format!("`{address}` is no address of a database (try postgres://user@host/database)")),
        }
    }

    /// As it was written, with the password, for whoever connects.
    pub fn exposed(&self) -> &str {
        &self.0
    }

    /// What follows the scheme, if it is one of PostgreSQL's.
    fn rest(&self) -> Option<&str> {
        ["postgres://", "postgresql://"].into_iter().find_map(|scheme| self.0.strip_prefix(scheme))
    }
}

/// Without the password.
impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rest = self.0.split_once("://").map_or(self.0.as_str(), |(_, rest)| rest);
        let scheme = self.0.strip_suffix(rest).unwrap_or_default();
        let (place, query) = rest.split_once('?').map_or((rest, None), |(place, query)| (place, Some(query)));
        // A password may hold an `@` that was not spelt as %40: the last one ends it.
        let (user, host) = place.rsplit_once('@').map_or((None, place), |(user, host)| (user.split(':').next(), host));
        let query = query.map(|query| {
            let kept: Vec<&str> = query.split('&').filter(|part| !part.to_ascii_lowercase().contains("pass")).collect();
            kept.join("&")
        });
        let query = query.filter(|query| !query.is_empty()).map(|query| format!("?{query}"));
        let user = user.map(|user| format!("{user}@"));
        write!(f, "{scheme}{}{host}{}", user.unwrap_or_default(), query.unwrap_or_default())
    }
}

impl fmt::Debug for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Address({self})")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_password_is_shown_nowhere() {
        for (written, shown) in [
            ("postgres://u@h/db", "postgres://u@h/db"),
            ("postgres://u:secret@h:5432/db?sslmode=require", "postgres://u@h:5432/db?sslmode=require"),
            ("postgres://u:se@cret@h/db", "postgres://u@h/db"),
            ("postgresql://h/db?user=u&password=secret", "postgresql://h/db?user=u"),
            ("postgres://u:secret@localhost/db?host=/run/pg", "postgres://u@localhost/db?host=/run/pg"),
        ] {
            let address = Address::parse(written).unwrap();
            assert_eq!((address.to_string().as_str(), address.exposed()), (shown, written));
            assert!(!format!("{address:?}").contains("secret"));
        }
        for wrong in ["mysql://u:secret@h/db", "u:secret@h/db", "postgres://", "postgres://u:secret@h/a b"] {
            let line = Address::parse(wrong).unwrap_err();
            assert!(line.contains("is no address of a database") && !line.contains("secret"), "{line}");
        }
    }
}
