"""The papers whose statements are tested as claims. Authors, titles and years are those that the damaged scans show."""

from __future__ import annotations

from mechlab.experiment.publication import Publication

GEAR_CVT = Publication(
    "gear CVT 2012",
    "Gear continuously variable transmission as a closed gear differential with two degrees of freedom",
    place="Problems of Mechanical Engineering (Problemy mashinostroeniya) 15, 5-6, ISSN 0131-2928",
    year=2012,
    readable="author and title are missing in the scan; the title is that of the abstract's subject",
)
"""Of the entry closed_differential."""

B_SPLINES = Publication(
    "B-spline length",
    "Calculation of the length of a B-spline curve",
    original="Vychislenie dliny B-splayn krivoy",
    readable="author and year are missing in the scan, which ends within the introduction; it follows the paper on the gear CVT",
)
"""Of the toolpaths of delta6."""

PROSTHESIS = Publication(
    "leg 2009",
    "Prismatic links in the transition matrices of an above-knee prosthesis",
    year=2009,
    place="received 2 April 2009",
    readable="the scan begins at equation (37): author and title are missing, the title is ours",
)
"""Of the entry prosthetic_leg."""

ZINCHENKO = Publication(
    "Zinchenko 2009",
    "Kinematic analysis of a mechanism of high class with a library of subroutines for groups of the second class",
    original="Kinematychnyy analiz mekhanizmu vysokoho klasu z vykorystannyam biblioteky pidprohram analizu hrup druhoho klasu",
    authors="O. I. Zinchenko",
    year=2009,
    place="NTU KhPI, Kharkiv",
    readable="the year is that of the article before it in the same volume",
)
"""Of the entry class4_linkage."""

PLANETARY = Publication(
    "2A-AA synthesis 2009",
    "Synthesis of the planetary mechanism 2A-AA with regard to pressure angles, for planets far out on a ray",
    original="Sintez planetarnogo mekhanizma 2A-AA s uchetom uglov zatsepleniya dlya radial'nogo dal'nego raspolozheniya satellitov",
    authors="S. N. Kavetsky, T. V. Beresh",
    year=2009,
    place="NTU KhPI, Kharkiv",
    readable="both surnames are damaged in the scan; the year is that of an article before it in the same volume",
)
"""Of the entry planetary."""

REGIONS = Publication(
    "Boolean algebras 2009",
    "Boolean algebras on the basis of continuous and continuously differentiable functions",
    original="Bulevi alhebry na bazi neperervnykh i neperervno-dyferentsiyovnykh funktsiy",
    year=2009,
    readable="the author is missing in the scan, which ends on the first page; the year is that of an article before it in the same volume",
)
"""Of the workspaces of delta6."""

ALYUKOV = Publication(
    "Alyukov",
    "Nonlinear vibrations of inertial continuously variable transmissions without overrunning clutches",
    original="Nelineynye kolebaniya inertsionnykh besstupenchatykh peredach bez mekhanizmov svobodnogo khoda",
    authors="S. V. Alyukov",
    readable="journal and year are missing in the scan",
)
"""Of the entry impulse_transmission."""

GEAR_LEVERS = Publication(
    "gear-lever mechanisms 1995",
    "On the use of gear-lever mechanisms in automatic printing machines",
    original="Pro vykorystannya zubchasto-vazhil'nykh mekhanizmiv u polihrafichnykh mashynakh-avtomatakh",
    year=1995,
    readable="the author is missing in the scan; the year is that of its receipt, read as 25.01.95",
)
"""Of the entry gear_linkage."""

THESIS = Publication(
    "thesis abstract 2021",
    "Abstract of a thesis on a parallel mechanism with six degrees of freedom, kinematic decoupling and constant ratios of rotation",
    year=2021,
    readable="the title page is missing in the scan: the title is that of the stated aim, the year that of the last conference",
)
"""Of the entry delta6."""

BIBLIOGRAPHY = (GEAR_CVT, B_SPLINES, PROSTHESIS, ZINCHENKO, PLANETARY, REGIONS, ALYUKOV, GEAR_LEVERS, THESIS)
"""All of them, in the order of the scans."""
