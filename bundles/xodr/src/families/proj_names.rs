//! Names that PROJ knows, <https://proj.org>: operations, ellipsoids, datums, prime meridians and
//! units in its sources up to PROJ 9 (`pj_list.h`, `ellps.cpp`, `datums.cpp`, `units.cpp`), and
//! common parameters. As in PROJ, case matters.

/// Valid names for `+proj=`.
pub(crate) const OPERATIONS: &str = "\
    adams_hemi adams_ws1 adams_ws2 aea aeqd affine airocean airy aitoff alsk apian august axisswap bacon bertin1953 \
    bipc boggs bonne calcofi cart cass cc ccon cea chamb col_urban collg comill crast defmodel deformation denoy \
    eck1 eck2 eck3 eck4 eck5 eck6 eqc eqdc eqearth etmerc euler fahey fouc fouc_s gall geoc geocent geogoffset geos \
    gins8 gn_sinu gnom goode gridshift gs48 gs50 gstmerc gtoc guyou hammer hatano healpix helmert hgridshift horner \
    igh igh_o imoll imoll_o imw_p isea kav5 kav7 krovak labrd laea lagrng larr lask latlon latlong lcc lcca leac \
    lee_os longlat lonlat loxim lsat mbt_fps mbt_s mbtfpp mbtfpq mbtfps merc mil_os mill misrsom mod_krovak moll \
    molobadekas molodensky murd1 murd2 murd3 natearth natearth2 nell nell_h nicol noop nsper nzmg ob_tran ocea oea \
    omerc ortel ortho patterson pconic peirce_q pipeline poly pop push putp1 putp2 putp3 putp3p putp4p putp5 putp5p \
    putp6 putp6p qsc qua_aut rhealpix robin rouss rpoly s2 sch set sinu som somerc spilhaus stere sterea tcc tcea \
    times tinshift tissot tmerc tobmerc topocentric tpeqd tpers unitconvert ups urm5 urmfps utm vandg vandg2 vandg3 \
    vandg4 vertoffset vgridshift vitk1 wag1 wag2 wag3 wag4 wag5 wag6 wag7 webmerc weren wink1 wink2 wintri \
    xyzgridshift";

/// Valid names for `+ellps=`.
pub(crate) const ELLIPSOIDS: &str = "\
    APL4.9 CPM danish GRS67 GRS80 GSK2011 IAU76 MERIT NWL9D PZ90 SEasia SGS85 WGS60 WGS66 WGS72 WGS84 airy andrae \
    aust_SA bess_nam bessel clrk66 clrk80 clrk80ign delmbr engelis evrst30 evrst48 evrst56 evrst69 evrstSS fschr60 \
    fschr60m fschr68 helmert hough intl kaula krass lerch mod_airy mprts new_intl plessis sphere walbeck";

/// Valid names for `+datum=`.
pub(crate) const DATUMS: &str =
    "WGS84 GGRS87 NAD83 NAD27 potsdam carthage hermannskogel ire65 nzgd49 OSGB36";

/// Valid names for `+pm=`. Numbers are valid as well.
pub(crate) const MERIDIANS: &str = "\
    greenwich lisbon paris bogota madrid rome bern jakarta ferro brussels stockholm athens oslo copenhagen";

/// Valid names for `+units=` and `+vunits=`.
pub(crate) const UNITS: &str = "\
    m km dm cm mm kmi in ft yd mi fath ch link us-in us-ft us-yd us-ch us-mi ind-yd ind-ft ind-ch";

/// Operations that do not give metres on a plane: degrees, or coordinates from the Earth's centre.
pub(crate) const NO_PROJECTIONS: &str = "longlat lonlat latlong latlon geocent cart noop";

/// Parameters that are angles, with their maximum value [°].
pub(crate) const ANGLES: &[(&str, f64)] = &[
    ("lat_0", 90.0),
    ("lat_1", 90.0),
    ("lat_2", 90.0),
    ("lat_3", 90.0),
    ("lat_ts", 90.0),
    ("lon_0", 360.0),
    ("lon_1", 360.0),
    ("lon_2", 360.0),
    ("lon_3", 360.0),
    ("lonc", 360.0),
    ("alpha", 360.0),
    ("gamma", 360.0),
];

/// Parameters that are numbers. The flag tells whether the number must be greater than zero.
pub(crate) const NUMBERS: &[(&str, bool)] = &[
    ("x_0", false),
    ("y_0", false),
    ("z_0", false),
    ("k", true),
    ("k_0", true),
    ("a", true),
    ("b", true),
    ("R", true),
    ("rf", true),
    ("to_meter", true),
];

/// Parameters that take a name, with the kind of name and the valid names.
pub(crate) const CHOICES: &[(&str, &str, &str)] = &[
    ("proj", "projection", OPERATIONS),
    ("ellps", "ellipsoid", ELLIPSOIDS),
    ("datum", "datum", DATUMS),
    ("units", "unit of length", UNITS),
    ("vunits", "unit of length", UNITS),
];

/// Projections onto a cone, defined by one or two latitudes.
pub(crate) const CONES: &[&str] = &["lcc", "aea", "eqdc"];

/// Returns the names of a list.
pub(crate) fn names(list: &'static str) -> impl Iterator<Item = &'static str> {
    list.split_whitespace()
}

/// Returns the parameters that need a value.
pub(crate) fn keys() -> impl Iterator<Item = &'static str> {
    let angles = ANGLES.iter().map(|(key, _)| *key);
    let numbers = NUMBERS.iter().map(|(key, _)| *key);
    let choices = CHOICES.iter().map(|(key, ..)| *key);
    angles
        .chain(numbers)
        .chain(choices)
        .chain(["zone", "pm", "init"])
}
