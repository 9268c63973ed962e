//! Flame and smoke from one field of soot temperature and density, stirred by a fractal field: the paper's section 5 and its picture 9.
//!
//! The paper defines flame and smoke as distributions of soot temperature and density whose flow a fractal fluctuation disturbs, and gives no equations. Here
//! the undisturbed distributions are those of a buoyant plume in closed form (`plume`). At each time the plume is sampled at coordinates that a scrolling
//! fractal field displaces (`displacement`). Soot of optical depth tau and temperature T adds `B(T) (1 - exp(-tau))` (Kirchhoff's law) and light that it scatters,
//! and absorbs what is behind it: hot soot is flame, cool soot is smoke, and there is no boundary between them.
//!
//! - W. R. Morton, G. Taylor and J. S. Turner, "Turbulent gravitational convection from maintained and instantaneous sources" (1956): linear spread.
//! - B. J. McCaffrey, "Purely buoyant diffusion flames: some experimental results" (1979): temperature over height.

pub(crate) mod displacement;
pub(crate) mod plume;

use bansho_base::parameters::{ParameterError, ParameterErrorKind};
use displacement::DisplacementTables;
use plume::PlumeTables;

use super::parameters::{ColorParameters, FlameSheetParameters, SheetMethod, SheetStage, SootFieldParameters};

/// Tables of a soot field, which do not change with time.
#[derive(Clone, Debug)]
pub(crate) struct SootFieldTables {
    pub(crate) plume: PlumeTables,
    pub(crate) displacement: DisplacementTables,
}

impl SootFieldTables {
    pub(super) fn new(field: &SootFieldParameters, color: &ColorParameters) -> Self {
        Self { plume: PlumeTables::new(field, color), displacement: DisplacementTables::new(field) }
    }
}

/// Checks what goes together with the method.
///
/// # Errors
/// A stage of the texture is to be shown, but a soot field has no texture.
pub(super) fn check(parameters: &FlameSheetParameters) -> Result<(), ParameterError> {
    if parameters.method == SheetMethod::SootField && parameters.stage != SheetStage::Flame {
        let kind = ParameterErrorKind::NotWith { allowed: "`\"flame\"`", other: "`method` is `\"soot_field\"`" };
        return Err(ParameterError { key: "stage", kind });
    }
    Ok(())
}
