//! The macros that declare parameter tables and choices.

/// Declares a table of parameters: a plain struct with its defaults, and the descriptors from which everything else is derived.
///
/// A line `paper: key, key;` after the struct names the parameters that are there only so that a paper can be followed to the letter
/// ([`Descriptor::is_for_paper`](crate::parameters::Descriptor::is_for_paper)).
///
/// ```
/// bansho_base::parameters! {
///     /// A lamp.
///     pub struct Lamp {
///         /// Radiant power.
///         power_w: f64 = 60.0, limits(bansho_base::parameters::Range::new(0.0, 1e6)), unit("W");
///         /// Whether it burns.
///         lit: bool = true;
///         /// Filament of the paper's lamp.
///         filament: f64 = 1.0;
///     }
///     paper: filament;
/// }
/// use bansho_base::parameters::Parameters;
/// assert_eq!(Lamp::table().parameters[0].key, "power_w");
/// assert!(Lamp::default().lit);
/// assert!(Lamp::table().parameters[2].is_for_paper);
/// ```
#[macro_export]
macro_rules! parameters {
    ($(#[doc = $table_doc:literal])* pub struct $Table:ident {
        $($(#[doc = $doc:literal])* $key:ident : $type:ty = $default:expr
            $(, limits($limits:expr))? $(, unit($unit:literal))? ;)*
    } $(paper: $($paper:ident),+ ;)?) => {
        $(#[doc = $table_doc])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $Table { $(
            $(#[doc = $doc])*
            ///
            $(#[doc = concat!("Unit: ", $unit, ".")])?
            #[doc = concat!("Default: `", stringify!($default), "`.")]
            $(#[doc = concat!("Limits: `", stringify!($limits), "`.")])?
            pub $key: $type,
        )* }

        impl Default for $Table {
            fn default() -> Self { Self { $($key: $default,)* } }
        }

        impl $crate::parameters::Parameters for $Table {
            fn table() -> &'static $crate::parameters::TableDescriptor {
                static TABLE: std::sync::LazyLock<$crate::parameters::TableDescriptor> = std::sync::LazyLock::new(|| {
                    let defaults = $Table::default();
                    // Names fields, so that a key that does not exist is an error of the compiler.
                    $($(let _ = &defaults.$paper;)+)?
                    let papers: &[&str] = &[$($(stringify!($paper)),+)?];
                    $crate::parameters::TableDescriptor {
                        doc: concat!($($table_doc, "\n"),*).trim().to_owned(),
                        parameters: vec![$($crate::parameters::Descriptor {
                            key: stringify!($key),
                            doc: concat!($($doc, "\n"),*).trim().to_owned(),
                            unit: concat!($($unit)?),
                            kind: <$type as $crate::parameters::Parameter>::kind(
                                &$crate::parameters!(@limits $type $(, $limits)?)),
                            default: $crate::parameters::Parameter::to_value(&defaults.$key),
                            is_for_paper: papers.contains(&stringify!($key)),
                        }),*],
                    }
                });
                &TABLE
            }

            fn read_table(
                table: &$crate::parameters::Table, reader: &mut $crate::parameters::Reader, ignored: &[&str],
            ) -> Self {
                <Self as $crate::parameters::Parameters>::report_unknown(table, reader, ignored);
                let mut result = Self::default();
                $(if let Some(node) = table.get(stringify!($key)) {
                    let limits = $crate::parameters!(@limits $type $(, $limits)?);
                    let unit = concat!($($unit)?);
                    if let Some(value) = reader.within(stringify!($key), |reader| {
                        <$type as $crate::parameters::Parameter>::read(node, &limits, unit, reader)
                    }) {
                        result.$key = value;
                    }
                })*
                result
            }

            fn check_values(&self, reader: &mut $crate::parameters::Reader) {
                $(reader.within(stringify!($key), |reader| {
                    let limits = $crate::parameters!(@limits $type $(, $limits)?);
                    <$type as $crate::parameters::Parameter>::check(&self.$key, &limits, concat!($($unit)?), reader);
                });)*
            }

            fn to_table(&self) -> $crate::parameters::Table {
                let mut table = $crate::parameters::Table::default();
                $(if let Some(value) = $crate::parameters::Parameter::to_value(&self.$key) {
                    table.push(stringify!($key), value);
                })*
                table
            }
        }

        impl $crate::parameters::Parameter for $Table {
            type Limits = ();

            fn kind(_: &()) -> $crate::parameters::Kind {
                $crate::parameters::Kind::Table(<Self as $crate::parameters::Parameters>::table)
            }

            fn read(
                node: &$crate::parameters::Node, limits: &(), _unit: &'static str,
                reader: &mut $crate::parameters::Reader,
            ) -> Option<Self> {
                match &node.value {
                    $crate::parameters::Value::Table(table) => {
                        Some(<Self as $crate::parameters::Parameters>::read_table(table, reader, &[]))
                    }
                    _ => { reader.wrong_type(node, &<Self as $crate::parameters::Parameter>::kind(limits)); None }
                }
            }

            fn to_value(&self) -> Option<$crate::parameters::Value> {
                Some($crate::parameters::Value::Table(<Self as $crate::parameters::Parameters>::to_table(self)))
            }

            fn check(&self, _limits: &(), _unit: &'static str, reader: &mut $crate::parameters::Reader) {
                <Self as $crate::parameters::Parameters>::check_values(self, reader);
            }

            fn continue_from(&mut self, before: &Self, t: f64, transition_s: f64) {
                $($crate::parameters::Parameter::continue_from(&mut self.$key, &before.$key, t, transition_s);)*
            }

            fn close_loop(&mut self, _period: f64) -> Option<String> {
                $(if let Some(rest) = $crate::parameters::Parameter::close_loop(&mut self.$key, _period) {
                    return Some($crate::parameters::path(stringify!($key), &rest));
                })*
                None
            }
        }
    };
    (@limits $type:ty) => { <<$type as $crate::parameters::Parameter>::Limits as Default>::default() };
    (@limits $type:ty, $limits:expr) => { <<$type as $crate::parameters::Parameter>::Limits>::from($limits) };
}

/// Declares a choice: an enum whose variants have names in scene files. The first is the default.
///
/// ```
/// bansho_base::choice! {
///     /// How an object moves.
///     pub enum Motion {
///         /// Not at all.
///         Still = "still",
///         /// Steadily.
///         Steady = "steady",
///     }
/// }
/// assert_eq!(Motion::default().name(), "still");
/// ```
#[macro_export]
macro_rules! choice {
    ($(#[doc = $choice_doc:literal])* pub enum $Choice:ident {
        $(#[doc = $first_doc:literal])* $First:ident = $first_name:literal,
        $($(#[doc = $doc:literal])* $Variant:ident = $name:literal),* $(,)?
    }) => {
        $(#[doc = $choice_doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
        pub enum $Choice {
            $(#[doc = $first_doc])* #[default] $First,
            $($(#[doc = $doc])* $Variant,)*
        }

        impl $Choice {
            /// Every choice with its name and meaning.
            pub const CHOICES: &'static [$crate::parameters::Choice] = &[
                $crate::parameters::Choice { name: $first_name, doc: concat!($($first_doc),*) },
                $($crate::parameters::Choice { name: $name, doc: concat!($($doc),*) },)*
            ];

            /// Its name in scene files.
            pub fn name(self) -> &'static str {
                match self { Self::$First => $first_name, $(Self::$Variant => $name,)* }
            }

            /// The choice of that name.
            pub fn from_name(name: &str) -> Option<Self> {
                match name { $first_name => Some(Self::$First), $($name => Some(Self::$Variant),)* _ => None }
            }
        }

        impl $crate::parameters::Parameter for $Choice {
            type Limits = ();

            fn kind(_: &()) -> $crate::parameters::Kind { $crate::parameters::Kind::Choice(Self::CHOICES) }

            fn read(
                node: &$crate::parameters::Node, limits: &(), _unit: &'static str,
                reader: &mut $crate::parameters::Reader,
            ) -> Option<Self> {
                let $crate::parameters::Value::Text(name) = &node.value else {
                    reader.wrong_type(node, &Self::kind(limits));
                    return None;
                };
                let found = Self::from_name(name);
                if found.is_none() {
                    reader.not_one_of(node, name, Self::CHOICES);
                }
                found
            }

            fn to_value(&self) -> Option<$crate::parameters::Value> {
                Some($crate::parameters::Value::Text(self.name().to_owned()))
            }

            fn check(&self, _limits: &(), _unit: &'static str, _reader: &mut $crate::parameters::Reader) {}
        }
    };
}
