"""to be written"""
class OscillatorModel: pass
def model_of_class(x): raise NotImplementedError
