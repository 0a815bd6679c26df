; Paints over the gallery's template with GIMP's own brush, on layers above it, and saves it.
; Script-Fu of GIMP 2.10; paint_over.py puts (define folder "...") before it.

(define (points . numbers) (list->vector numbers))

(define image
  (let ((path (string-append folder "template/template.png")))
    (car (gimp-file-load RUN-NONINTERACTIVE path path))))

(define (new-layer name mode)
  (let ((layer (car (gimp-layer-new image (car (gimp-image-width image))
                                    (car (gimp-image-height image)) RGBA-IMAGE name 100 mode))))
    (gimp-image-insert-layer image layer 0 -1)
    layer))

(define (stroke layer colour size opacity places)
  (gimp-context-set-foreground colour)
  (gimp-context-set-brush-size size)
  (gimp-context-set-opacity opacity)
  (gimp-paintbrush-default layer (vector-length places) places))

; Saved as one picture of 8 bits, like File > Export As; the layers stay open.
(define (export name)
  (let ((flat (car (gimp-image-duplicate image)))
        (path (string-append folder "template/" name)))
    (gimp-image-flatten flat)
    (gimp-image-convert-precision flat 150)
    (gimp-file-save RUN-NONINTERACTIVE flat (car (gimp-image-get-active-layer flat)) path path)
    (gimp-image-delete flat)))

(gimp-context-set-defaults)
(gimp-context-set-brush "2. Hardness 025")
(gimp-context-set-dynamics "Dynamics Off")

; Night: a dark blue over everything, multiplied, so that the room shows through.
(define night (new-layer "night" LAYER-MODE-MULTIPLY))
(gimp-context-set-foreground '(92 100 136))
(gimp-drawable-edit-fill night FILL-FOREGROUND)

; Warm light on the vase and on the knot, dodged: it brightens what is there.
(define lamps (new-layer "lamps" LAYER-MODE-DODGE))
(stroke lamps '(176 140 92) 64 60 (points 512 175 514 215 514 285))
(stroke lamps '(150 112 70) 90 40 (points 480 318 540 322))
(stroke lamps '(176 140 92) 56 60 (points 388 180 392 215 390 290))

; A warm streak on the bricks below the blue pictures, which no lamp lights alone.
(define streak (new-layer "streak" LAYER-MODE-DODGE))
(stroke streak '(190 140 84) 44 70 (points 10 262 90 255 165 246))
(export "dusk.png")

; The same without it.
(gimp-item-set-visible streak FALSE)
(export "dusk-2.png")
