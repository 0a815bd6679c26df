; Paints on the template in FOLDER with GIMP's own brush and saves what GIMP can.
; Script-Fu of GIMP 2.10. test_programs.py puts (define folder "...") before it.

(define (open name)
  (car (gimp-file-load RUN-NONINTERACTIVE (string-append folder "template/" name) name)))

(define (save image name)
  (let ((path (string-append folder name)))
    (gimp-file-save RUN-NONINTERACTIVE image (car (gimp-image-get-active-layer image)) path path)))

(define (stroke layer colour x y)
  (gimp-context-set-foreground colour)
  (gimp-paintbrush-default layer 4 (vector x y (+ x 12) y)))

; On a layer of its own, then flattened, as people do.
(define (painted name)
  (let* ((image (open name))
         (layer (car (gimp-layer-new image (car (gimp-image-width image))
                                     (car (gimp-image-height image)) RGBA-IMAGE "paint" 100
                                     LAYER-MODE-NORMAL))))
    (gimp-image-insert-layer image layer 0 0)
    (gimp-context-set-defaults)
    (gimp-context-set-brush "2. Hardness 050")
    (gimp-context-set-dynamics "Dynamics Off")
    (gimp-context-set-brush-size 48)
    (gimp-context-set-opacity 80)
    (stroke layer '(255 200 120) 54 48)
    (stroke layer '(70 110 220) 134 92)
    (gimp-image-flatten image)
    image))

(define (jpeg image name quality)
  (file-jpeg-save RUN-NONINTERACTIVE image (car (gimp-image-get-active-layer image))
                  (string-append folder name) name quality 0 1 0 "" 2 1 0 0))

(let ((image (painted "template.exr")))
  (save image "light-float.exr")
  (save image "light-float.tif")
  (save image "light-png16.png")
  (gimp-image-convert-precision image 500) ; half, linear
  (save image "light-half.exr"))
(let ((image (painted "template.png")))
  (save image "shown-png16.png")
  (save image "shown-tif16.tif")
  (save image "shown-psd16.psd")
  (jpeg image "shown-q95.jpg" 0.95)
  (jpeg image "shown-q85.jpg" 0.85)
  (gimp-image-convert-precision image 150) ; 8 bits, with sRGB's curve
  (save image "shown-png8.png"))
(let ((image (painted "template.png")))
  (gimp-image-convert-precision image 600)
  (save image "shown-float.exr"))
(save (open "template.png") "same.png")
(save (open "template.exr") "same.exr")
