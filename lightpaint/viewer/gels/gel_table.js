/**
 * Colour filters for lamps: code, name, and the tristimulus values of the light that passes, CIE
 * 1931 x and y, and Y in percent of the light without the filter.
 *
 * L: LEE Filters, under tungsten light of 3200 K. R: Roscolux of Rosco, under CIE source A. Both
 * makers publish these numbers, in swatch books and on their pages; here they are as collected by
 * Reid Sox-Harris, color-filter-sds 0.2.0 (MIT licence). Makers change their filters: a swatch in
 * front of the lamp has the last word.
 */
export const GEL_ROWS = `
L200 Double C.T. Blue .25 .256 14.9
L201 Full C.T. Blue .33 .339 35
L202 Half C.T. Blue .372 .374 53.2
L203 Quarter C.T. Blue .398 .39 70.5
L218 Eighth C.T. Blue .411 .395 80.2
L204 Full C.T. Orange .51 .42 62.8
L205 Half C.T. Orange .474 .417 74.5
L206 Quarter C.T. Orange .45 .41 82.6
L223 Eighth C.T. Orange .44 .406 85
L441 Full C.T. Straw .515 .419 61.8
L442 Half C.T. Straw .474 .42 73.8
L443 Quarter C.T. Straw .448 .412 82
L444 Eighth C.T. Straw .435 .405 84.4
L244 LEE Plus Green .421 .447 74
L245 Half Plus Green .423 .425 81.6
L246 Quarter Plus Green .424 .413 85
L247 LEE Minus Green .457 .359 60
L248 Half Minus Green .441 .378 71
L249 Quarter Minus Green .433 .389 80.5
L298 0.15ND .425 .402 71.1
L209 0.3ND .423 .404 50
L210 0.6ND .423 .407 24.5
L211 0.9ND .421 .421 11.8
L299 1.2ND .417 .405 5.8
L002 Rose Pink .491 .287 34.2
L003 Lavender Tint .422 .387 75
L004 Medium Bastard Amber .488 .391 65.5
L007 Pale Yellow .446 .423 87.2
L008 Dark Salmon .58 .374 43
L009 Pale Amber Gold .479 .417 75
L010 Medium Yellow .492 .479 88.1
L013 Straw Tint .485 .428 75.7
L015 Deep Straw .549 .443 67.5
L019 Fire .665 .33 24
L020 Medium Amber .558 .424 56.8
L021 Gold Amber .611 .383 39.5
L022 Dark Amber .643 .355 30.5
L024 Scarlet .634 .33 25.5
L025 Sunset Red .62 .354 34.2
L026 Bright Red .701 .299 9.1
L027 Medium Red .709 .286 5.3
L035 Light Pink .462 .37 64
L036 Medium Pink .495 .345 48.2
L046 Dark Magenta .644 .282 8.2
L052 Light Lavender .391 .315 31.4
L053 Paler Lavender .402 .378 60.5
L058 Lavender .312 .185 8
L061 Mist Blue .377 .385 60
L063 Pale Blue .358 .376 52
L068 Sky Blue .174 .207 9.4
L071 Tokyo Blue .154 .035 .3
L079 Just Blue .153 .139 4.3
L088 Lime Green .429 .505 69.8
L089 Moss Green .311 .58 28
L090 Dark Yellow Green .196 .685 9
L101 Yellow .508 .473 80.7
L102 Light Amber .505 .45 78
L103 Straw .458 .416 84.8
L104 Deep Amber .532 .451 73
L105 Orange .59 .406 50
L106 Primary Red .693 .305 12.8
L107 Light Rose .508 .365 54
L109 Light Salmon .497 .371 58
L110 Middle Rose .478 .354 54.4
L111 Dark Pink .522 .324 39.7
L113 Magenta .662 .29 14.7
L115 Peacock Blue .198 .414 28.6
L116 Medium Blue-Green .13 .4 12.4
L117 Steel Blue .332 .39 53
L118 Light Blue .174 .309 19.2
L119 Dark Blue .137 .109 2.3
L120 Deep Blue .147 .068 1.1
L121 LEE Green .392 .53 58
L122 Fern Green .336 .549 45.7
L124 Dark Green .212 .618 25.6
L126 Mauve .463 .18 5
L128 Bright Pink .565 .256 18.8
L131 Marine Blue .268 .419 37
L132 Medium Blue .148 .195 7
L134 Golden Amber .559 .398 43.2
L135 Deep Golden Amber .649 .35 26.5
L137 Special Lavender .348 .3 28
L138 Pale Green .419 .463 75
L139 Primary Green .212 .717 10.1
L140 Summer Blue .277 .367 36.8
L141 Bright Blue .147 .267 14
L142 Pale Violet .306 .262 19.4
L143 Pale Navy Blue .241 .32 13.1
L144 No Colour Blue .237 .348 28.3
L147 Apricot .534 .404 58.3
L148 Bright Rose .617 .302 21.1
L151 Gold Tint .48 .392 69
L152 Pale Gold .472 .4 74.2
L154 Pale Rose .465 .393 73.1
L156 Chocolate .497 .412 24.7
L157 Pink .558 .348 40.1
L158 Deep Orange .612 .387 40.6
L159 No Colour Straw .436 .409 87.5
L161 Slate Blue .25 .291 21.5
L162 Bastard Amber .458 .402 79.5
L164 Flame Red .663 .327 23.2
L165 Daylight Blue .211 .273 17.3
L170 Deep Lavender .412 .317 24.3
L174 Dark Steel Blue .302 .33 30.3
L176 Loving Amber .52 .375 55
L179 Chrome Orange .56 .432 61
L180 Dark Lavender .283 .164 6.9
L181 Congo Blue .187 .058 .6
L182 Light Red .686 .311 15
L192 Flesh Pink .527 .331 41.4
L194 Surprise Pink .364 .293 22.4
L195 Zenith Blue .154 .098 2.5
L196 True Blue .255 .319 23.9
L197 Alice Blue .235 .225 9
L198 Palace Blue .185 .119 1.1
R02 Bastard Amber .488 .409 73.66
R03 Dark Bastard Amber .517 .401 62.81
R04 Medium Bastard Amber .508 .398 66.25
R05 Rose Tint .477 .399 74.35
R06 No Color Straw .457 .415 87.05
R07 Pale Yellow .467 .425 86.05
R08 Pale Gold .477 .419 77.2
R09 Pale Amber Gold .502 .418 73.89
R10 Medium Yellow .511 .468 83.92
R12 Straw .512 .463 80.5
R14 Medium Straw .538 .439 69.45
R15 Deep Straw .56 .433 67.68
R16 Light Amber .529 .417 67.55
R18 Flame .543 .407 55.11
R19 Fire .659 .339 25.2
R20 Medium Amber .573 .414 56.42
R21 Golden Amber .608 .385 44.35
R22 Deep Amber .639 .359 31.98
R23 Orange .618 .372 38.95
R25 Orange Red .663 .33 21.06
R26 Light Red .677 .316 14.54
R27 Medium Red .692 .302 4.83
R32 Medium Salmon Pink .585 .35 36.14
R33 No Color Pink .481 .385 66.14
R35 Light Pink .48 .383 65.88
R36 Medium Pink .511 .361 49.74
R38 Light Rose .478 .378 50.47
R39 Skelton Exotic Sangria .584 .268 11.24
R40 Light Salmon .59 .366 40.67
R44 Middle Rose .525 .314 33.05
R46 Magenta .643 .298 7.57
R47 Light Rose Purple .433 .302 9.01
R49 Medium Purple .496 .229 5.76
R50 Mauve .591 .343 14.46
R51 Surprise Pink .438 .38 53.29
R52 Light Lavender .42 .351 34.23
R54 Special Lavender .424 .377 48.85
R55 Lilac .385 .361 33.03
R57 Lavender .371 .315 21.12
R58 Deep Lavender .335 .245 10.06
R59 Indigo .228 .126 1.19
R60 No Color Blue .397 .392 48.85
R62 Booster Blue .373 .39 39.65
R63 Pale Blue .387 .395 50.91
R64 Light Steel Blue .29 .341 21.22
R65 Daylight Blue .283 .352 25.09
R66 Cool Blue .39 .41 58.94
R67 Light Sky Blue .253 .331 20.04
R68 Parry Sky Blue .183 .255 9.95
R69 Brilliant Blue .181 .324 13.44
R70 Nile Blue .323 .399 33.99
R71 Sea Blue .261 .383 21.62
R73 Peacock Blue .274 .418 24.2
R74 Night Blue .124 .151 2.79
R76 Light Green Blue .147 .333 5.92
R77 Green Blue .162 .273 5.97
R78 Trudy Blue .29 .308 16.61
R79 Bright Blue .161 .197 5.47
R80 Primary Blue .157 .209 5.95
R81 Urban Blue .215 .258 9.47
R82 Surprise Blue .208 .212 5.04
R83 Medium Blue .149 .158 2.98
R84 Zephyr Blue .229 .258 8.69
R85 Deep Blue .148 .157 2.09
R86 Pea Green .432 .512 43.13
R87 Pale Yellow Green .449 .431 73.49
R88 Light Green .45 .452 68.74
R89 Moss Green .363 .554 28.35
R90 Dark Yellow Green .256 .661 8.11
R91 Primary Green .28 .561 3.77
R92 Turquoise .341 .462 42.18
R93 Blue Green .311 .454 22.71
R94 Kelly Green .251 .553 16.43
R95 Medium Blue Green .18 .451 9.17
R97 Light Grey .451 .411 44.66
R98 Medium Grey .457 .408 23.71
R99 Chocolate .503 .404 32.37`;
