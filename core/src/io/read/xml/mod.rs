//! XML of a part, pulled element by element within bounds.
//!
//! **In:** the bytes of a part; its name, for reasons.
//! **Out:** [`Element`]s with their namespace by its URI, and text; where each stands in the part.
//! **Promise:** no DTD, no entity besides the five of XML, nothing from outside. Depth, attributes and names are bounded; nothing is kept but the
//! elements that are open. Tags match, attributes are there once.
//!
//! By XML 1.0 (fifth edition), of which only UTF-8 is read, and Namespaces in XML 1.0.

mod element;
mod pull;
mod scopes;
#[cfg(test)]
mod tests;

pub(super) use element::Element;
pub(super) use pull::{Node, Xml};
pub(super) use scopes::Scopes;
